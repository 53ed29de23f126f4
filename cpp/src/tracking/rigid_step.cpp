#include "tracking/rigid_step.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

#include "support/eigen_points.hpp"
#include "support/geometry.hpp"

namespace dynmesh {

SmallMotion fit_to_planes(std::span<const SurfaceRow> rows, std::span<const Vector3<double>> x,
                          double caution) {
  SmallMotion motion;
  double total = 0;
  for (const SurfaceRow& row : rows) {
    motion.centre = motion.centre + row.weight * row.on(x);
    total += row.weight;
  }
  if (!(total > 0)) return motion;
  motion.centre = (1 / total) * motion.centre;
  double square = 0;
  for (const SurfaceRow& row : rows) {
    square += row.weight * squared_norm(row.on(x) - motion.centre);
  }
  const double reach = std::sqrt(square / total);
  if (!(reach > 0) || !std::isfinite(reach)) return motion;
  Eigen::Matrix<double, 6, 6> normal = Eigen::Matrix<double, 6, 6>::Zero();
  Eigen::Matrix<double, 6, 1> right = Eigen::Matrix<double, 6, 1>::Zero();
  for (const SurfaceRow& row : rows) {
    const auto place = row.on(x);
    const Eigen::Vector3d n = to_eigen(row.normal);
    Eigen::Matrix<double, 6, 1> moved;
    moved << to_eigen((1 / reach) * (place - motion.centre)).cross(n), n;
    normal += row.weight * moved * moved.transpose();
    right += row.weight * dot(row.normal, row.point - place) * moved;
  }
  normal.diagonal().array() += caution * normal.trace() / 6;
  const Eigen::Matrix<double, 6, 1> solution = normal.ldlt().solve(right);
  if (!solution.allFinite()) return motion;
  motion.turn = from_eigen(solution.head<3>() / reach);
  motion.shift = from_eigen(solution.tail<3>());
  return motion;
}

Eigen::AngleAxisd rotation_of(const SmallMotion& motion) {
  const Eigen::Vector3d turn = to_eigen(motion.turn);
  const double angle = turn.norm();
  return angle > 0 ? Eigen::AngleAxisd(angle, turn / angle) : Eigen::AngleAxisd::Identity();
}

double move_by(const SmallMotion& motion, std::span<Vector3<double>> frame) {
  const Eigen::Matrix3d rotation = rotation_of(motion).toRotationMatrix();
  double largest = 0;
  for (auto& x : frame) {
    const auto moved =
        from_eigen(rotation * to_eigen(x - motion.centre)) + motion.centre + motion.shift;
    largest = std::max(largest, squared_norm(moved - x));
    x = moved;
  }
  return std::sqrt(largest);
}

}  // namespace dynmesh
