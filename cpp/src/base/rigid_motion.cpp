#include "base/rigid_motion.hpp"

#include <Eigen/SVD>
#include <cstddef>

namespace dynmesh {
namespace {

/// If the squared spread of points across a line is below this fraction of that along the line, the
/// points count as collinear. The precision of float coordinates does not allow a finer
/// distinction.
constexpr double collinear = 1e-10;

}  // namespace

RigidMotion fit_rigid_motion(const Moments& moments) {
  const Eigen::Vector3d& from = moments.before;
  const Eigen::Vector3d& to = moments.now;
  // The decomposition of what is not finite would be that of memory never written.
  if (!moments.arms.now.allFinite()) return {.from = from, .to = to};
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(moments.arms.now,
                                              Eigen::ComputeFullU | Eigen::ComputeFullV);
  const Eigen::Vector3d& spread = svd.singularValues();
  if (!(spread[1] > collinear * spread[0])) return {.from = from, .to = to};

  const double handedness = (svd.matrixU() * svd.matrixV().transpose()).determinant();
  const Eigen::Vector3d signs(1, 1, handedness < 0 ? -1 : 1);
  const Eigen::Matrix3d rotation = svd.matrixU() * signs.asDiagonal() * svd.matrixV().transpose();
  return {rotation, from, to, spread[1]};
}

RigidMotion fit_rigid_motion(std::span<const Index> vertices, Field before, Field after) {
  return fit_rigid_motion(moments_of([&](const auto& visit) {
    for (const Index v : vertices) visit(to_eigen(before[v]), to_eigen(after[v]));
  }));
}

RigidMotion fit_rigid_motion(Field before, Field after) {
  return fit_rigid_motion(moments_of([&](const auto& visit) {
    for (std::size_t v = 0; v < before.size(); ++v) visit(to_eigen(before[v]), to_eigen(after[v]));
  }));
}

}  // namespace dynmesh
