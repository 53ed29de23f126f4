#include "tracking/agreement.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <iterator>

#include "support/geometry.hpp"

namespace dynmesh {
namespace {

/// An agreement that has numbers of points in the place of shares, and a sum of squares in that of
/// the distance.
Agreement no_points() { return {0, 0, 0, 0}; }

void average(Agreement& sums, double mean_edge) {
  const auto n = static_cast<double>(sums.points);
  sums.distance = mean_edge * std::sqrt(sums.distance / (n - sums.far_share));
  sums.far_share /= n;
  sums.disagreeing /= n;
}

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
    const double cosine = dot(scan.normals[i], normals[places[i].nearest_corner()]);
    return scan.is_undecided(i) || is_either[places[i].nearest_corner()] != 0
               ? std::abs(cosine) >= constants.least_undecided_cosine
               : cosine >= constants.least_cosine;
  };
  const auto strays = find_strays(scan, is_near, constants);
  Agreements found{no_points(), std::vector<Agreement>(scan.sensors.size(), no_points())};
  for (std::size_t i = 0; i < places.size(); ++i) {
    if (strays[i] != 0) continue;
    const auto add_to = [&](Agreement& sums) {
      ++sums.points;
      if (is_near[i] == 0) {
        ++sums.far_share;
        return;
      }
      sums.disagreeing += agrees(i) ? 0 : 1;
      sums.distance += places[i].squared / (mean_edge * mean_edge);
    };
    add_to(found.all);
    if (!found.of_sensors.empty()) add_to(found.of_sensors[scan.sensor_of(i)]);
  }
  average(found.all, mean_edge);
  for (Agreement& sums : found.of_sensors) average(sums, mean_edge);
  return found;
}

}  // namespace dynmesh
