/// Fits a rigid motion between two sets of points.
#pragma once

#include <array>
#include <dynmesh/types.hpp>
#include <span>

#include "support/geometry.hpp"

namespace dynmesh {

/// x -> rotation * (x - from) + to, in double precision.
struct RigidMotion {
  std::array<std::array<double, 3>, 3> rotation = {{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};
  std::array<double, 3> from{};
  std::array<double, 3> to{};

  template <class Real>
  [[nodiscard]] Vector3<Real> apply(const Vector3<Real>& point) const {
    const std::array<double, 3> arm = {static_cast<double>(point.x) - from[0],
                                       static_cast<double>(point.y) - from[1],
                                       static_cast<double>(point.z) - from[2]};
    const auto coordinate = [&](std::size_t c) {
      return saturated<Real>(rotation[c][0] * arm[0] + rotation[c][1] * arm[1] +
                             rotation[c][2] * arm[2] + to[c]);
    };
    return {coordinate(0), coordinate(1), coordinate(2)};
  }
};

/// Returns the least-squares rigid motion from `before[v]` to `after[v]` over the given vertices
/// (Kabsch 1976, with a positive determinant). If there are fewer than three vertices, or if all
/// lie on a line, the rotation is not determined and the mean translation is returned. `vertices`
/// must not be empty.
template <class Real>
RigidMotion fit_rigid_motion(std::span<const Index> vertices, std::span<const Vector3<Real>> before,
                             std::span<const Vector3<Real>> after);

/// The same for all points.
template <class Real>
RigidMotion fit_rigid_motion(std::span<const Vector3<Real>> before,
                             std::span<const Vector3<Real>> after);

}  // namespace dynmesh
