/// How well a surface explains what was measured of it.
#include <algorithm>
#include <cmath>
#include <utility>

#include "base/geometry.hpp"
#include "base/statistics.hpp"
#include "surface_fit/surface_matcher.hpp"

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
  if (std::ranges::find(is_near, 0) == is_near.end()) return strays;
  constexpr std::size_t enough = 256;
  std::vector<double> usual;
  for (std::size_t i = 0; i < n; i += 1 + n / enough) {
    usual.push_back(scan.squared_spacing(i));
  }
  const double limit =
      constants.stray_spacing * constants.stray_spacing * quantile(std::move(usual), 0.5);
  for (std::size_t i = 0; i < n; ++i) {
    if (is_near[i] == 0 && scan.squared_spacing(i) > limit) strays[i] = 1;
  }
  return strays;
}

}  // namespace

double distance_of_far(const MatchedPoints& points, double widest) {
  double sum = 0;
  double n = 0;
  for (const Place& place : points.places) {
    if (!points.is_far(place)) continue;
    sum += std::min(place.squared, std::pow(widest, 2));
    n += 1;
  }
  return n > 0 ? std::sqrt(sum / n) : 0;
}

Agreements agreements_of(const MatchedPoints& points, const TrackingConstants& constants) {
  const PointScan& scan = *points.scan;
  const double mean_edge = points.mean_edge;
  std::vector<std::uint8_t> is_near(scan.size(), 1);  // points that were left out are no strays
  for (std::size_t i = 0; i < points.places.size(); ++i) {
    is_near[points.numbers[i]] = points.is_far(points.places[i]) ? 0 : 1;
  }
  const auto strays = find_strays(scan, is_near, constants);
  Agreements found{no_points(), std::vector<Agreement>(scan.sensors.size(), no_points())};
  for (std::size_t i = 0; i < points.places.size(); ++i) {
    const std::size_t number = points.numbers[i];
    if (strays[number] != 0) continue;
    const auto add_to = [&](Agreement& sums) {
      ++sums.points;
      if (points.is_far(points.places[i])) {
        ++sums.far_share;
        return;
      }
      sums.disagreeing += points.agrees[i] != 0 ? 0 : 1;
      sums.distance += points.places[i].squared / (mean_edge * mean_edge);
    };
    add_to(found.all);
    // What is farther than the surface can be is of other things, which one sensor may see alone.
    const bool is_other = !points.places[i].any();
    if (!found.of_sensors.empty() && !is_other) add_to(found.of_sensors[scan.sensor_of(number)]);
  }
  average(found.all, mean_edge);
  for (Agreement& sums : found.of_sensors) average(sums, mean_edge);
  return found;
}

}  // namespace dynmesh
