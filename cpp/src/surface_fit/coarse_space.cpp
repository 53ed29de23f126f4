#include "surface_fit/coarse_space.hpp"

#include "base/geometry.hpp"
#include "base/rigid_motion.hpp"

namespace dynmesh {
namespace {

/// How often the functions of patches are averaged: about as often as a patch has rings.
constexpr int averagings = 6;
/// Smaller values of them are left out, so that few meet at a vertex.
constexpr double least_value = 0.02;

using Rows3 = Eigen::Matrix<double, Eigen::Dynamic, 3, Eigen::RowMajor>;

/// A field as a matrix in its memory.
Eigen::Map<const Rows3, Eigen::Unaligned, Eigen::OuterStride<4>> matrix_of(Field field) {
  return {&field[0].x, static_cast<Eigen::Index>(field.size()), 3};
}

}  // namespace

CoarseSpace::CoarseSpace(const Cells& cells, Field first_frame, const Clusters& clusters,
                         const Matrix& normal, std::span<const Tie> ties) {
  std::vector<Vector3> centres;
  for (const Index centre : clusters.centres) centres.push_back(first_frame[centre]);
  const Clusters patches = cluster_vertices(clusters.neighbours, centres);
  std::vector<Eigen::Triplet<double>> in_patches, in_rings;
  for (Index v = 0; v < static_cast<Index>(cells.size()); ++v) {
    in_patches.emplace_back(v, patches.of_vertex[clusters.of_vertex[v]], 1);
    const double part = 1 / static_cast<double>(cells[v].size() + 1);
    in_rings.emplace_back(v, v, part);
    for (const Index other : cells[v]) in_rings.emplace_back(v, other, part);
  }
  Functions average(normal.rows(), normal.rows());
  average.setFromTriplets(in_rings.begin(), in_rings.end());
  psi_.resize(normal.rows(), static_cast<Eigen::Index>(patches.size()));
  psi_.setFromTriplets(in_patches.begin(), in_patches.end());
  for (int n = 0; n < averagings; ++n) psi_ = average * psi_;
  psi_.prune(least_value, 1);
  const Eigen::VectorXd sums = psi_ * Eigen::VectorXd::Ones(psi_.cols());
  psi_ = sums.cwiseInverse().asDiagonal() * psi_;
  transposed_ = psi_.transpose();
  const Matrix small = psi_.transpose() * (normal * psi_);
  n_ = small.triangularView<Eigen::Lower>();
  Matrix tied = n_;
  add_ties(ties, tied);
  n_ = n_ + 0 * tied;
  for (Eigen::Index v = 0; v < psi_.rows(); ++v) {
    for (Functions::InnerIterator i(psi_, v); i; ++i) {
      for (Functions::InnerIterator j(psi_, v); j && j.col() <= i.col(); ++j) {
        const double* entry = &n_.coeffRef(i.col(), j.col());
        entry_of_.push_back(static_cast<std::uint32_t>(entry - n_.valuePtr()));
      }
    }
  }
  factor_.analyzePattern(with_blocks(n_, Blocks(n_.nonZeros(), Eigen::Matrix3d::Zero())));
}

/// Adds Psi^T (e_i - e_j) w (e_i - e_j)^T Psi for each tie, in the lower triangle.
void CoarseSpace::add_ties(std::span<const Tie> ties, Matrix& n) const {
  for (const Tie& tie : ties) {
    const auto end = [&](std::uint32_t v, double sign, const auto& visit) {
      for (Functions::InnerIterator psi(psi_, static_cast<Index>(v)); psi; ++psi) {
        visit(psi.col(), sign * psi.value());
      }
    };
    const auto both_ends = [&](const auto& visit) {
      end(tie.i, 1, visit);
      end(tie.j, -1, visit);
    };
    both_ends([&](auto row, double a) {
      both_ends([&](auto column, double b) {
        if (column <= row) n.coeffRef(row, column) += tie.weight * a * b;
      });
    });
  }
}

/// The lower triangle of the matrix of all coordinates: `n`, and a block for each entry of it.
CoarseSpace::Matrix CoarseSpace::with_blocks(const Matrix& n, const Blocks& blocks) const {
  Matrix matrix(3 * n.rows(), 3 * n.cols());
  matrix.reserve(9 * n.nonZeros());
  for (Eigen::Index column = 0; column < matrix.cols(); ++column) {
    matrix.startVec(column);
    const auto c = column % 3;
    for (Matrix::InnerIterator entry(n, column / 3); entry; ++entry) {
      const auto& block = blocks[&entry.value() - n.valuePtr()];
      for (Eigen::Index r = entry.row() == entry.col() ? c : 0; r < 3; ++r) {
        matrix.insertBack(3 * entry.row() + r, column) = block(r, c) + (r == c ? entry.value() : 0);
      }
    }
  }
  matrix.finalize();
  return matrix;
}

void CoarseSpace::factorize(std::span<const SurfaceRow> rows, double factor,
                            std::span<const double> held, std::span<const Tie> ties) {
  Blocks at_vertices(psi_.rows(), Eigen::Matrix3d::Zero());
  for (const SurfaceRow& row : rows) {
    const Eigen::Matrix3d block = to_eigen(row.normal) * to_eigen(row.normal).transpose();
    for (std::size_t s = 0; s < 3; ++s) {
      at_vertices[row.corners[s]] += factor * row.weight * row.shares[s] * block;
    }
  }
  Blocks blocks(n_.nonZeros(), Eigen::Matrix3d::Zero());
  auto entry = entry_of_.begin();
  for (Eigen::Index v = 0; v < psi_.rows(); ++v) {
    at_vertices[v].diagonal().array() += held[v];
    for (Functions::InnerIterator i(psi_, v); i; ++i) {
      for (Functions::InnerIterator j(psi_, v); j && j.col() <= i.col(); ++j) {
        blocks[*entry++] += i.value() * j.value() * at_vertices[v];
      }
    }
  }
  Matrix n = n_;
  add_ties(ties, n);
  factor_.factorize(with_blocks(n, blocks));
}

void CoarseSpace::add(Field residual, std::span<Vector3> x, Workers& workers) {
  if (factor_.info() != Eigen::Success) return;
  constexpr Index vertices = 50;  // of a patch
  Rows3 right(psi_.cols(), 3);
  workers.for_each_short_chunk(
      static_cast<Index>(right.rows()),
      [&](Index first, Index last) {
        right.middleRows(first, last - first).noalias() =
            transposed_.middleRows(first, last - first) * matrix_of(residual);
      },
      vertices);
  const Eigen::VectorXd solution =
      factor_.solve(Eigen::Map<const Eigen::VectorXd>(right.data(), right.size()));
  workers.for_each_in_chunks(x.size(), [&](std::size_t v) {
    for (Functions::InnerIterator share(psi_, static_cast<Index>(v)); share; ++share) {
      x[v] = x[v] + share.value() * from_eigen(solution.segment<3>(3 * share.col()));
    }
  });
}

}  // namespace dynmesh
