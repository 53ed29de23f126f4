#include "support/rigid_motion.hpp"

#include <Eigen/SVD>
#include <numeric>
#include <vector>

namespace dynmesh {
namespace {

/// If the squared spread of points across a line is below this fraction of that along the line, the
/// points count as collinear. The precision of float coordinates does not allow a finer
/// distinction.
constexpr double collinear = 1e-10;

}  // namespace

template <class Real>
RigidMotion fit_rigid_motion(std::span<const Index> vertices, std::span<const Vector3<Real>> before,
                             std::span<const Vector3<Real>> after) {
  Eigen::Vector3d from = Eigen::Vector3d::Zero();
  Eigen::Vector3d to = Eigen::Vector3d::Zero();
  for (const Index v : vertices) {
    from += to_eigen(before[v]);
    to += to_eigen(after[v]);
  }
  from /= static_cast<double>(vertices.size());
  to /= static_cast<double>(vertices.size());

  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
  for (const Index v : vertices) {
    covariance += (to_eigen(after[v]) - to) * (to_eigen(before[v]) - from).transpose();
  }

  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(covariance,
                                              Eigen::ComputeFullU | Eigen::ComputeFullV);
  const Eigen::Vector3d& spread = svd.singularValues();
  if (!(spread[1] > collinear * spread[0])) return {.from = from, .to = to};

  const double handedness = (svd.matrixU() * svd.matrixV().transpose()).determinant();
  const Eigen::Vector3d signs(1, 1, handedness < 0 ? -1 : 1);
  const Eigen::Matrix3d rotation = svd.matrixU() * signs.asDiagonal() * svd.matrixV().transpose();
  return {rotation, from, to, spread[1]};
}

template <class Real>
RigidMotion fit_rigid_motion(std::span<const Vector3<Real>> before,
                             std::span<const Vector3<Real>> after) {
  std::vector<Index> all(before.size());
  std::iota(all.begin(), all.end(), Index{0});
  return fit_rigid_motion<Real>(all, before, after);
}

template RigidMotion fit_rigid_motion(std::span<const Vector3<double>>,
                                      std::span<const Vector3<double>>);
template RigidMotion fit_rigid_motion(std::span<const Index>, std::span<const Vector3<float>>,
                                      std::span<const Vector3<float>>);
template RigidMotion fit_rigid_motion(std::span<const Index>, std::span<const Vector3<double>>,
                                      std::span<const Vector3<double>>);

}  // namespace dynmesh
