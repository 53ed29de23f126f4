#include "tracking/agreement.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <iterator>

#include "support/geometry.hpp"

namespace dynmesh {
namespace {

/// Adds points, and then their mean.
class Sum {
 public:
  void add(double squared, bool is_near, bool agrees) {
    ++points_;
    if (!is_near) {
      ++far_;
      return;
    }
    if (!agrees) ++disagreeing_;
    squares_ += squared;
  }

  [[nodiscard]] Agreement result(double mean_edge) const {
    const auto n = static_cast<double>(points_);
    Agreement found;
    found.points = points_;
    if (points_ > 0) found.far_share = static_cast<double>(far_) / n;
    if (points_ > 0) found.disagreeing = static_cast<double>(disagreeing_) / n;
    if (points_ > far_) {
      found.distance = mean_edge * std::sqrt(squares_ / static_cast<double>(points_ - far_));
    }
    return found;
  }

 private:
  std::size_t points_ = 0;
  std::size_t far_ = 0;
  std::size_t disagreeing_ = 0;
  double squares_ = 0;
};

/// (n,) which of the points of a scan are of no surface, such as outliers: they are not near the
/// mesh, and have fewer points around them than most.
std::vector<std::uint8_t> find_strays(const PointScan& scan, std::span<const std::uint8_t> is_near,
                                      const TrackingConstants& constants) {
  const std::size_t n = is_near.size();
  std::vector<std::uint8_t> strays(n);
  const auto neighbours = static_cast<std::size_t>(constants.stray_neighbours);
  if (n <= neighbours || std::ranges::find(is_near, 0) == is_near.end()) return strays;
  if (!scan.is_indexed()) scan.index();
  constexpr std::size_t enough = 256;
  std::vector<double> usual;
  for (std::size_t i = 0; i < n; i += 1 + n / enough) {
    usual.push_back(scan.squared_spacing(i, neighbours));
  }
  const auto middle = usual.begin() + std::ssize(usual) / 2;
  std::ranges::nth_element(usual, middle);
  const double limit = constants.stray_spacing * constants.stray_spacing * *middle;
  for (std::size_t i = 0; i < n; ++i) {
    if (is_near[i] == 0 && scan.squared_spacing(i, neighbours) > limit) strays[i] = 1;
  }
  return strays;
}

}  // namespace

Agreements compare(const PointScan& scan, std::span<const Place> places,
                   std::span<const Vector3<double>> normals,
                   std::span<const std::uint8_t> is_either, double mean_edge,
                   const TrackingConstants& constants) {
  const double far = constants.far_distance * mean_edge;
  std::vector<std::uint8_t> is_near(places.size());
  for (std::size_t i = 0; i < places.size(); ++i) {
    is_near[i] = places[i].squared <= far * far ? 1 : 0;
  }
  const auto agrees = [&](std::size_t i) {
    const double cosine = dot(scan.normal(i), normals[places[i].nearest_corner()]);
    return scan.is_undecided(i) || is_either[places[i].nearest_corner()] != 0
               ? std::abs(cosine) >= constants.least_undecided_cosine
               : cosine >= constants.least_cosine;
  };
  const auto strays = find_strays(scan, is_near, constants);
  Sum all;
  std::vector<Sum> of_sensors(scan.viewpoints().size());
  for (std::size_t i = 0; i < places.size(); ++i) {
    if (strays[i] != 0) continue;
    const bool agreeing = is_near[i] != 0 && agrees(i);
    const double squared = places[i].squared / (mean_edge * mean_edge);
    all.add(squared, is_near[i] != 0, agreeing);
    if (!of_sensors.empty()) {
      of_sensors[scan.sensor_of(i)].add(squared, is_near[i] != 0, agreeing);
    }
  }
  Agreements found;
  found.all = all.result(mean_edge);
  for (const Sum& sum : of_sensors) found.of_sensors.push_back(sum.result(mean_edge));
  return found;
}

}  // namespace dynmesh
