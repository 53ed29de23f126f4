#include "tracking/rigid_step.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "support/rigid_motion.hpp"

namespace dynmesh {

Eigen::Isometry3d fit_to_planes(std::span<const SurfaceRow> rows,
                                std::span<const Vector3<double>> x) {
  const auto nothing = Eigen::Isometry3d::Identity();
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();
  double total = 0;
  for (const SurfaceRow& row : rows) {
    centre += row.weight * to_eigen(row.on(x));
    total += row.weight;
  }
  if (!(total > 0)) return nothing;
  centre /= total;
  double square = 0;
  for (const SurfaceRow& row : rows) {
    square += row.weight * (to_eigen(row.on(x)) - centre).squaredNorm();
  }
  const double reach = std::sqrt(square / total);
  if (!(reach > 0) || !std::isfinite(reach)) return nothing;
  Eigen::Matrix<double, 6, 6> normal = Eigen::Matrix<double, 6, 6>::Zero();
  Eigen::Matrix<double, 6, 1> right = Eigen::Matrix<double, 6, 1>::Zero();
  for (const SurfaceRow& row : rows) {
    const Eigen::Vector3d arm = to_eigen(row.on(x)) - centre;
    const Eigen::Vector3d n = to_eigen(row.normal);
    Eigen::Matrix<double, 6, 1> moved;
    moved << (arm / reach).cross(n), n;
    normal += row.weight * moved * moved.transpose();
    right += row.weight * n.dot(to_eigen(row.point) - centre - arm) * moved;
  }
  constexpr double caution = 1e-3;  // the share of the mean diagonal that is added
  normal.diagonal().array() += caution * normal.trace() / 6;
  const Eigen::Matrix<double, 6, 1> solution = normal.ldlt().solve(right);
  if (!solution.allFinite()) return nothing;
  const Eigen::Vector3d turn = solution.head<3>() / reach;
  const Eigen::AngleAxisd rotation(turn.norm(), turn.normalized());
  return Eigen::Translation3d(centre + solution.tail<3>()) * rotation *
         Eigen::Translation3d(-centre);
}

double move_by(const Eigen::Isometry3d& motion, std::span<Vector3<double>> frame) {
  double largest = 0;
  for (auto& x : frame) {
    const Eigen::Vector3d moved = motion * to_eigen(x);
    largest = std::max(largest, (moved - to_eigen(x)).squaredNorm());
    x = from_eigen(moved);
  }
  return std::sqrt(largest);
}

}  // namespace dynmesh
