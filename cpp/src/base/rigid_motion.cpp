#include "base/rigid_motion.hpp"

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
  Moments moments;
  moments.number = static_cast<double>(vertices.size());
  for (const Index v : vertices) {
    moments.before += to_eigen(before[v]);
    moments.now += to_eigen(after[v]);
  }
  moments.before /= moments.number;
  moments.now /= moments.number;
  for (const Index v : vertices) {
    moments.arms.add(1, to_eigen(before[v]) - moments.before, to_eigen(after[v]) - moments.now);
  }
  return fit_rigid_motion(moments);
}

RigidMotion fit_rigid_motion(Field before, Field after) {
  std::vector<Index> all(before.size());
  std::iota(all.begin(), all.end(), Index{0});
  return fit_rigid_motion(all, before, after);
}

}  // namespace dynmesh
