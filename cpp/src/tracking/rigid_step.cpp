#include "tracking/rigid_step.hpp"

#include <Eigen/Dense>
#include <cmath>

#include "support/eigen_points.hpp"
#include "support/geometry.hpp"

namespace dynmesh {

SmallMotion fit_to_planes(std::span<const Vector3<double>> frame,
                          std::span<const Correspondence> found, double caution) {
  SmallMotion motion;
  double total = 0;
  for (std::size_t v = 0; v < frame.size(); ++v) {
    motion.centre = motion.centre + found[v].weight * frame[v];
    total += found[v].weight;
  }
  if (!(total > 0)) return motion;
  motion.centre = (1 / total) * motion.centre;
  double square = 0;
  for (std::size_t v = 0; v < frame.size(); ++v) {
    square += found[v].weight * squared_norm(frame[v] - motion.centre);
  }
  const double reach = std::sqrt(square / total);
  if (!(reach > 0) || !std::isfinite(reach)) return motion;
  Eigen::Matrix<double, 6, 6> normal = Eigen::Matrix<double, 6, 6>::Zero();
  Eigen::Matrix<double, 6, 1> right = Eigen::Matrix<double, 6, 1>::Zero();
  for (std::size_t v = 0; v < frame.size(); ++v) {
    const Correspondence& c = found[v];
    if (c.weight == 0) continue;
    const Eigen::Vector3d n = to_eigen(c.normal);
    Eigen::Matrix<double, 6, 1> row;
    row << to_eigen((1 / reach) * (frame[v] - motion.centre)).cross(n), n;
    normal += c.weight * row * row.transpose();
    right += c.weight * dot(c.normal, c.point - frame[v]) * row;
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

void move_rigidly(const SmallMotion& motion, std::span<Vector3<double>> frame) {
  const Eigen::Matrix3d rotation = rotation_of(motion).toRotationMatrix();
  for (auto& x : frame) {
    x = from_eigen(rotation * to_eigen(x - motion.centre)) + motion.centre + motion.shift;
  }
}

void rigid_step(Correspondences& correspondences, const Search& search,
                const TrackingConstants& constants, std::span<Vector3<double>> x) {
  const auto found = correspondences.find(x, search);
  if (correspondences.n_found() < static_cast<std::size_t>(constants.least_rigid)) return;
  move_rigidly(fit_to_planes(x, found, constants.rigid_caution), x);
}

Search rigid_search(double radius, double scale, std::size_t n_vertices,
                    const TrackingConstants& constants) {
  const std::size_t stride = 1 + n_vertices / static_cast<std::size_t>(constants.rigid_vertices);
  return {radius, scale, scale, 1, stride};
}

}  // namespace dynmesh
