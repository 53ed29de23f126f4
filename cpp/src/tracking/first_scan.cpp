#include "tracking/first_scan.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <stdexcept>

#include "support/geometry.hpp"
#include "tracking/rigid_step.hpp"

namespace dynmesh {
namespace {

using Field = std::span<const Vector3<double>>;

/// Whether at least this share of the visible vertices, or of the points if they are fewer, find a
/// point.
bool lies_in(Field x, Correspondences& correspondences, const TrackingConstants& constants,
             double share) {
  correspondences.find_visible(x);
  correspondences.find(x, {constants.wide_radius, constants.scale, constants.side, 1});
  return correspondences.have_share(share);
}

/// The mean of some of the measured points, which is enough.
Vector3<double> centre_of(const Measurement& measurement) {
  const std::size_t stride = 1 + measurement.size() / 4096;
  Vector3<double> sum;
  double n = 0;
  for (std::size_t i = 0; i < measurement.size(); i += stride) {
    sum = sum + measurement.point(i);
    n += 1;
  }
  return (1 / n) * sum;
}

Vector3<double> centre_of_visible(Field x, std::span<const Sight> visible) {
  Vector3<double> sum;
  double n = 0;
  for (std::size_t v = 0; v < x.size(); ++v) {
    if (visible[v] == Sight::hidden) continue;
    sum = sum + x[v];
    n += 1;
  }
  return (1 / std::max(n, 1.0)) * sum;
}

}  // namespace

bool move_to_first_scan(const Measurement& measurement, Correspondences& correspondences,
                        const TrackingConstants& constants, double mean_edge,
                        std::span<Vector3<double>> x) {
  if (lies_in(x, correspondences, constants, constants.least_found)) return false;
  const auto centre = centre_of_visible(x, correspondences.visible());
  const auto shift = centre_of(measurement) - centre;
  double reach = 0;
  for (auto& position : x) {
    reach = std::max(reach, std::sqrt(squared_norm(position - centre)));
    position = position + shift;
  }
  // From the size of the template around its centre down to the radius of the iterations.
  const double widest = std::max(reach / mean_edge, constants.rigid_radius);
  for (int step = 0; step < constants.alignment_steps; ++step) {
    const double progress = static_cast<double>(step) / constants.alignment_steps;
    const double radius = widest * std::pow(constants.rigid_radius / widest, progress);
    correspondences.find_visible(x);
    rigid_step(correspondences, rigid_search(radius, radius, x.size(), constants), constants, x);
  }
  const bool is_enough = measurement.size() >= static_cast<std::size_t>(constants.least_rigid);
  if (is_enough && lies_in(x, correspondences, constants, constants.least_aligned)) return true;
  const double distance = std::sqrt(squared_norm(shift));
  std::array<char, 320> text{};
  (void)std::snprintf(text.data(), text.size(),
                      "points: the template is far from the first scan: their centres are %.4g "
                      "apart, %.4g mean edges of the template, and no rigid alignment was found; "
                      "both must be in the same axes and unit of length, and the template in the "
                      "pose of the scan",
                      distance, distance / mean_edge);
  throw std::invalid_argument(text.data());
}

}  // namespace dynmesh
