/// Conversions of positions for the linear algebra of Eigen.
#pragma once

#include <Eigen/Core>
#include <dynmesh/types.hpp>

namespace dynmesh {

template <class Real>
Eigen::Vector3d to_eigen(const Vector3<Real>& v) {
  return {static_cast<double>(v.x), static_cast<double>(v.y), static_cast<double>(v.z)};
}

inline Vector3<double> from_eigen(const Eigen::Vector3d& v) { return {v.x(), v.y(), v.z()}; }

}  // namespace dynmesh
