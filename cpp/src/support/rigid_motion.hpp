/// Positions and rigid motions in the linear algebra of Eigen.
#pragma once

#include <Eigen/Geometry>
#include <dynmesh/types.hpp>
#include <span>

#include "support/geometry.hpp"

namespace dynmesh {

template <class Real>
Eigen::Vector3d to_eigen(const Vector3<Real>& v) {
  return {static_cast<double>(v.x), static_cast<double>(v.y), static_cast<double>(v.z)};
}

inline Vector3<double> from_eigen(const Eigen::Vector3d& v) { return {v.x(), v.y(), v.z()}; }

/// x -> rotation * (x - from) + to, in double precision.
struct RigidMotion {
  Eigen::Matrix3d rotation = Eigen::Matrix3d::Identity();
  Eigen::Vector3d from = Eigen::Vector3d::Zero();
  Eigen::Vector3d to = Eigen::Vector3d::Zero();
  /// The sum of the squares of how far the points to which it was fitted are from a line, before
  /// times after.
  double squared_across = 0;

  template <class Real>
  [[nodiscard]] Vector3<Real> apply(const Vector3<Real>& point) const {
    const Eigen::Vector3d arm = to_eigen(point) - from;
    return saturated<Real>(from_eigen(rotation.col(0) * arm.x() + rotation.col(1) * arm.y() +
                                      rotation.col(2) * arm.z() + to));
  }
};

inline Eigen::Isometry3d to_eigen(const RigidMotion& given) {
  Eigen::Isometry3d motion(given.rotation);
  motion.translation() = given.to - motion.linear() * given.from;
  return motion;
}

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
