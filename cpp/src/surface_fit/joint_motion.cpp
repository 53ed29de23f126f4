#include "surface_fit/joint_motion.hpp"

#include <Eigen/Dense>
#include <Eigen/Sparse>
#include <algorithm>
#include <cmath>
#include <vector>

#include "base/geometry.hpp"
#include "base/rigid_motion.hpp"

namespace dynmesh {
namespace {

using Sparse = Eigen::SparseMatrix<double>;
/// How a difference changes with the motion of a component.
using Change = Eigen::Matrix<double, 3, 6>;

/// Adds a block of 6 by 6 for two components.
void add_block(std::vector<Eigen::Triplet<double>>& entries, Index a, Index b,
               const PlaneMotion::Matrix& block) {
  for (Index row = 0; row < 6; ++row) {
    for (Index column = 0; column < 6; ++column) {
      entries.emplace_back(6 * a + row, 6 * b + column, block(row, column));
    }
  }
}

/// (components,) the sums of the rows of each component. One without rows stays where it is, by a
/// weight that is nothing beside that of a tie.
std::vector<PlaneMotion> sums_of(std::span<const SurfaceRow> rows, const Topology& topology,
                                 double reach, Field x) {
  std::vector<std::vector<SurfaceRow>> component_rows(topology.report.components);
  for (const SurfaceRow& row : rows) {
    component_rows[at(topology.component[row.corners[0]])].push_back(row);
  }
  std::vector<std::vector<Vector3>> positions(component_rows.size());
  for (std::size_t v = 0; v < x.size(); ++v) positions[at(topology.component[v])].push_back(x[v]);
  std::vector<PlaneMotion> sums;
  for (std::size_t c = 0; c < component_rows.size(); ++c) {
    sums.emplace_back(component_rows[c], x);
    if (sums.back().weight > 0) continue;
    constexpr double nothing = 1e-6;
    sums.back() = PlaneMotion(positions[c], reach);
    sums.back().normal.diagonal().array() += nothing;
  }
  return sums;
}

}  // namespace

double move_jointly(std::span<const SurfaceRow> rows, std::span<const Tie> ties, double reach,
                    double stiffness, const Topology& topology, const TrackingConstants& constants,
                    std::span<Vector3> x, std::span<Vector3> differences) {
  if (ties.empty()) {  // of a single component
    const Eigen::Isometry3d motion = fit_to_planes(rows, x);
    return move(x, [&](std::size_t) { return motion; });
  }
  std::vector<PlaneMotion> sums = sums_of(rows, topology, reach, x);
  std::vector<Eigen::Triplet<double>> entries;
  for (std::size_t t = 0; t < ties.size(); ++t) {
    const Tie& tie = ties[t];
    const Index a = topology.component[tie.i];
    const Index b = topology.component[tie.j];
    PlaneMotion& first = sums[at(a)];
    PlaneMotion& second = sums[at(b)];
    const bool is_near = squared_norm(tie.kept) <= reach * reach;
    const double shared = is_near ? constants.tie_share * std::min(first.weight, second.weight) : 0;
    const double weight = stiffness * (1 + shared) * tie.weight / constants.tie_weight;
    // The difference changes by that of the motions of both ends, and turns by their mean.
    const Eigen::Vector3d wanted = to_eigen(differences[t]);
    const Eigen::Vector3d off = wanted - to_eigen(x[tie.i] - x[tie.j]);
    Change change_a, change_b;
    change_a << (cross_matrix(wanted) / 2 - cross_matrix(to_eigen(x[tie.i]) - first.centre)) /
                    first.reach,
        Eigen::Matrix3d::Identity();
    change_b << (cross_matrix(wanted) / 2 + cross_matrix(to_eigen(x[tie.j]) - second.centre)) /
                    second.reach,
        -Eigen::Matrix3d::Identity();
    first.normal += weight * change_a.transpose() * change_a;
    second.normal += weight * change_b.transpose() * change_b;
    first.right += weight * change_a.transpose() * off;
    second.right += weight * change_b.transpose() * off;
    const PlaneMotion::Matrix both = weight * change_a.transpose() * change_b;
    add_block(entries, a, b, both);
    add_block(entries, b, a, both.transpose());
  }
  const auto n = static_cast<Index>(sums.size());
  Eigen::VectorXd right(6 * n);
  for (Index c = 0; c < n; ++c) {
    add_block(entries, c, c, sums[at(c)].normal);
    right.segment<6>(6 * c) = sums[at(c)].right;
  }
  Sparse matrix(6 * n, 6 * n);
  matrix.setFromTriplets(entries.begin(), entries.end());
  const Eigen::SimplicialLDLT<Sparse> factor(matrix);
  if (factor.info() != Eigen::Success) return 0;
  const Eigen::VectorXd solution = factor.solve(right);
  if (!solution.allFinite()) return 0;
  std::vector<Eigen::Isometry3d> motions;
  for (Index c = 0; c < n; ++c) {
    motions.push_back(sums[at(c)].motion(solution.segment<6>(6 * c)));
  }
  const auto motion_of = [&](std::size_t v) { return motions[at(topology.component[v])]; };
  for (std::size_t t = 0; t < ties.size(); ++t) {
    const Eigen::Matrix3d turned = motion_of(ties[t].i).linear() + motion_of(ties[t].j).linear();
    differences[t] = 0.5 * from_eigen(turned * to_eigen(differences[t]));
  }
  return move(x, motion_of);
}

}  // namespace dynmesh
