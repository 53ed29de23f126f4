#include <Eigen/Cholesky>
#include <array>
#include <cmath>

#include "base/symmetric_eigen.hpp"
#include "kernels/rotation_kernels.hpp"

namespace dynmesh {
namespace {

/// The weight of the last rotation relative to a covariance. It decides between rotations that are
/// equally good for the covariance, and is too small to have an effect otherwise.
constexpr double pull_to_last = 1e-9;

/// A rotation counts as optimal if its trace is below the largest one by at most this, the size of
/// rounding errors.
constexpr double rounding = 1e-13;

Eigen::Vector4d in_eigen(const Quaternion& q) { return {q.w, q.x, q.y, q.z}; }

}  // namespace

/// For unit quaternions tr(R^T S) = q^T N q, with N the symmetric matrix of Horn (1987), so the
/// best rotation is the eigenvector of the largest eigenvalue. It exists for any rank of S, whether
/// or not S contains a reflection.
Quaternion best_rotation(const double (&s)[3][3], const Quaternion& last, const Quaternion& found) {
  Eigen::Matrix4d n;
  n << s[0][0] + s[1][1] + s[2][2], s[2][1] - s[1][2], s[0][2] - s[2][0], s[1][0] - s[0][1],  //
      s[2][1] - s[1][2], s[0][0] - s[1][1] - s[2][2], s[0][1] + s[1][0], s[0][2] + s[2][0],   //
      s[0][2] - s[2][0], s[0][1] + s[1][0], s[1][1] - s[0][0] - s[2][2], s[1][2] + s[2][1],   //
      s[1][0] - s[0][1], s[0][2] + s[2][0], s[1][2] + s[2][1], s[2][2] - s[0][0] - s[1][1];
  if (!n.allFinite()) return last;
  const Eigen::Vector4d q = in_eigen(found);
  const double trace = q.dot(n * q);
  // Only a matrix without negative eigenvalues has a Cholesky factor.
  const Eigen::Matrix4d gap = (trace + rounding) * Eigen::Matrix4d::Identity() - n;
  if (std::isfinite(trace) && gap.llt().info() == Eigen::Success) return found;
  n += pull_to_last * in_eigen(last) * in_eigen(last).transpose();
  std::array<double, 4> values{};
  symmetric_eigen({n.data(), 16}, values);  // its eigenvectors are the columns of n
  const Eigen::Vector4d best = n.col(3).normalized();
  return {best[0], best[1], best[2], best[3]};
}

}  // namespace dynmesh
