#include "shape/turn_errors.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>

#include "base/geometry.hpp"
#include "base/rigid_motion.hpp"
#include "shape/constants.hpp"

namespace dynmesh {
namespace {

Eigen::Matrix3d matrix_of(const std::array<Vector3, 3>& rows) {
  Eigen::Matrix3d matrix;
  for (Eigen::Index i = 0; i < 3; ++i) matrix.row(i) = to_eigen(rows[at(static_cast<Index>(i))]);
  return matrix;
}

/// The expected error of the rotation after a frame, if it grows by `size` about each axis.
Eigen::Matrix3d grown(const Eigen::Matrix3d& before, const ComponentRotation& turn, double size) {
  if (turn.axes == 3) return Eigen::Matrix3d::Zero();
  const Eigen::Matrix3d rotation = rotation_matrix(turn.rotation);
  Eigen::Matrix3d after =
      rotation * before * rotation.transpose() + size * Eigen::Matrix3d::Identity();
  if (turn.axes == 2) after = (after * turn.line).norm() * turn.line * turn.line.transpose();
  // A larger angle says no more.
  return after * std::min(1.0, std::numbers::pi / after.norm());
}

}  // namespace

void add_turn_errors(std::span<const ComponentRotation> turns, const Topology& topology,
                     const Generations& generations, Field x, const ErrorMemory& memory,
                     ErrorMemory& next) {
  const double kept = uncertainty_constants.kept_of_scale;
  Energy& of_all = next.turns_of_all;
  of_all = kept * memory.turns_of_all;
  for (std::size_t i = 0; i < turns.size(); ++i) {
    const Energy newest = {turns[i].squared_angle, static_cast<double>(turns[i].compared_axes), 0};
    of_all = of_all + newest;
    next.turns[i].found = kept * memory.turns[i].found;
    // Two axes, which are always the same if the anchors are, say little about the third one.
    if (turns[i].compared_axes == 3) next.turns[i].found = next.turns[i].found + newest;
  }
  const double pull = uncertainty_constants.pull_of_turns;
  const bool any_known =
      std::ranges::any_of(turns, [](const ComponentRotation& turn) { return turn.axes == 3; });
  for (std::size_t i = 0; i < turns.size(); ++i) {
    double mean = of_all.x / of_all.y;
    if (!(of_all.y > 0)) {
      // It may rest or turn as its leader does, and if there is none, it may turn anyhow.
      const auto& [w, ix, iy, iz] = turns[i].rotation;
      const double angle = 2 * std::atan2(std::hypot(ix, iy, iz), std::abs(w));
      mean = std::pow(any_known ? angle : std::numbers::pi, 2) / 3;
    }
    const Energy& found = next.turns[i].found;
    const double size =
        uncertainty_constants.tail_of_turns * std::sqrt((found.x + pull * mean) / (found.y + pull));
    const Eigen::Matrix3d error = grown(matrix_of(memory.turns[i].error), turns[i], size);
    for (Eigen::Index row = 0; row < 3; ++row) {
      next.turns[i].error[at(static_cast<Index>(row))] = from_eigen(error.row(row));
    }
  }
  const auto generation = generations.of_vertices();
  for (std::size_t v = 0; v < generation.size(); ++v) {
    const std::size_t i = at(topology.component[v]);
    if (generation[v] <= 0 || turns[i].axes == 3) continue;
    const Eigen::Vector3d arm = to_eigen(x[v]) - turns[i].centre;
    // Of (angle about each axis) x arm, the sum of squares; a chord is shorter than its arc.
    const Eigen::Matrix3d error = matrix_of(next.turns[i].error);
    const double squares = error.squaredNorm();
    const double chord = squares > 0 ? 2 * (1 - std::exp(-squares / 2)) / squares : 0;
    const double square = squares * arm.squaredNorm() - (error * arm).squaredNorm();
    double& standard_error = next.standard_errors[v];
    standard_error = std::hypot(standard_error, std::sqrt(std::max(chord * square, 0.0) / 3));
  }
}

}  // namespace dynmesh
