/// Conversions of positions and motions for the linear algebra of Eigen.
#pragma once

#include <Eigen/Geometry>
#include <dynmesh/types.hpp>

#include "support/rigid_motion.hpp"

namespace dynmesh {

template <class Real>
Eigen::Vector3d to_eigen(const Vector3<Real>& v) {
  return {static_cast<double>(v.x), static_cast<double>(v.y), static_cast<double>(v.z)};
}

inline Vector3<double> from_eigen(const Eigen::Vector3d& v) { return {v.x(), v.y(), v.z()}; }

inline Eigen::Isometry3d to_eigen(const RigidMotion& given) {
  using Matrix = Eigen::Matrix<double, 3, 3, Eigen::RowMajor>;
  Eigen::Isometry3d motion = Eigen::Isometry3d::Identity();
  motion.linear() = Eigen::Map<const Matrix>(given.rotation[0].data());
  motion.translation() =
      Eigen::Vector3d(given.to.data()) - motion.linear() * Eigen::Vector3d(given.from.data());
  return motion;
}

}  // namespace dynmesh
