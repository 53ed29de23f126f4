#include "surface_fit/surface_rows.hpp"

#include <Eigen/Dense>
#include <cmath>

#include "base/geometry.hpp"
#include "base/rigid_motion.hpp"

namespace dynmesh {
namespace {

/// The numbers of a field as they lie in memory, four for each vertex.
auto vector_of(Field field) {
  return Eigen::Map<const Eigen::VectorXd>(&field[0].x, std::ssize(field) * 4);
}
auto vector_of(std::span<Vector3> field) {
  return Eigen::Map<Eigen::VectorXd>(&field[0].x, std::ssize(field) * 4);
}

}  // namespace

Eigen::Isometry3d fit_to_planes(std::span<const SurfaceRow> rows, Field x) {
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

RowMatrix::RowMatrix(std::span<const SurfaceRow> rows, std::size_t n_vertices)
    : matrix_(static_cast<Eigen::Index>(rows.size()), static_cast<Eigen::Index>(4 * n_vertices)) {
  matrix_.reserve(9 * matrix_.rows());
  for (Eigen::Index r = 0; r < matrix_.rows(); ++r) {
    const SurfaceRow& row = rows[r];
    const Eigen::Vector3d normal = std::sqrt(row.weight) * to_eigen(row.normal);
    matrix_.startVec(r);
    for (std::size_t s = 0; s < 3; ++s) {
      if (row.shares[s] == 0) continue;  // rows of a single vertex have it in all corners
      for (Eigen::Index c = 0; c < 3; ++c) {
        const Eigen::Index column = 4 * static_cast<Eigen::Index>(row.corners[s]) + c;
        matrix_.insertBackByOuterInnerUnordered(r, column) = row.shares[s] * normal[c];
      }
    }
  }
  matrix_.finalize();
  transposed_ = matrix_.transpose();
}

void RowMatrix::add_forces(std::span<const SurfaceRow> rows, Field x,
                           std::span<Vector3> forces) const {
  Eigen::VectorXd offsets(matrix_.rows());
  for (Eigen::Index r = 0; r < offsets.size(); ++r) {
    const SurfaceRow& row = rows[r];
    offsets[r] = std::sqrt(row.weight) * dot(row.normal, row.point - row.on(x));
  }
  vector_of(forces) += transposed_ * offsets;
}

void RowMatrix::add_product(Field step, std::span<Vector3> product, Workers& workers) const {
  Eigen::VectorXd along(matrix_.rows());
  workers.for_each_short_chunk(static_cast<Index>(matrix_.rows()), [&](Index first, Index last) {
    along.segment(first, last - first).noalias() =
        matrix_.middleRows(first, last - first) * vector_of(step);
  });
  workers.for_each_short_chunk(static_cast<Index>(step.size()), [&](Index first, Index last) {
    vector_of(product.subspan(at(first), at(last - first))).noalias() +=
        transposed_.middleRows(4 * first, 4 * (last - first)) * along;
  });
}

}  // namespace dynmesh
