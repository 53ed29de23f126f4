/// How a tracked surface moves as a whole: in every frame, and to a first scan that lies elsewhere.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <stdexcept>

#include "support/geometry.hpp"
#include "tracking/rigid_alignment.hpp"
#include "tracking/surface_tracking.hpp"

namespace dynmesh {

/// A rigid motion has six unknowns, so some of the vertices are enough.
std::size_t SurfaceTracking::rigid_stride() const {
  return 1 + x_.size() / static_cast<std::size_t>(constants_.rigid_vertices);
}

void SurfaceTracking::move_as_a_whole(const Measurement& measurement, const Search& search) {
  if (correspond(measurement, search).found < static_cast<std::size_t>(constants_.least_rigid))
    return;
  move_rigidly(fit_to_planes(x_, found_, constants_.rigid_caution), x_);
}

bool SurfaceTracking::lies_in(const Measurement& measurement, double share) {
  const Search search = {constants_.wide_radius, constants_.scale, constants_.side, 1};
  find_visible(measurement);
  const Tally tally = correspond(measurement, search);
  const std::size_t most = std::min(tally.seen, measurement.size());
  return tally.found > 0 && static_cast<double>(tally.found) >= share * static_cast<double>(most);
}

/// If the template is not where the first measurement is, moves it there. Returns whether that was
/// needed. Throws std::invalid_argument if it was not possible.
bool SurfaceTracking::align(const Measurement& measurement) {
  if (lies_in(measurement, constants_.least_found)) return false;
  // The sum of few points is enough.
  const std::size_t stride = 1 + measurement.size() / 4096;
  Vector3<double> measured;
  double n_measured = 0;
  for (std::size_t i = 0; i < measurement.size(); i += stride) {
    measured = measured + measurement.point(i);
    n_measured += 1;
  }
  Vector3<double> seen;
  double n_seen = 0;
  for (std::size_t v = 0; v < x_.size(); ++v) {
    if (seen_[v] == Sight::hidden) continue;
    seen = seen + x_[v];
    n_seen += 1;
  }
  const auto centre = (1 / std::max(n_seen, 1.0)) * seen;
  const auto shift = (1 / n_measured) * measured - centre;
  double reach = 0;
  for (auto& x : x_) {
    reach = std::max(reach, std::sqrt(squared_norm(x - centre)));
    x = x + shift;
  }
  // From the size of the template around its centre down to the radius of the iterations.
  const double widest = std::max(reach / mean_edge_, constants_.rigid_radius);
  for (int step = 0; step < constants_.alignment_steps; ++step) {
    const double progress = static_cast<double>(step) / constants_.alignment_steps;
    const double radius = widest * std::pow(constants_.rigid_radius / widest, progress);
    find_visible(measurement);
    move_as_a_whole(measurement, {radius, radius, radius, 1, rigid_stride()});
  }
  const bool is_enough = measurement.size() >= static_cast<std::size_t>(constants_.least_rigid);
  if (is_enough && lies_in(measurement, constants_.least_aligned)) return true;
  const double distance = std::sqrt(squared_norm(shift));
  std::array<char, 320> text{};
  (void)std::snprintf(text.data(), text.size(),
                      "points: the template is far from the first scan: their centres are %.4g "
                      "apart, %.4g mean edges of the template, and no rigid alignment was found; "
                      "both must be in the same axes and unit of length, and the template in the "
                      "pose of the scan",
                      distance, distance / mean_edge_);
  throw std::invalid_argument(text.data());
}

}  // namespace dynmesh
