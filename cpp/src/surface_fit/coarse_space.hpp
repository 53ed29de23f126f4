/// Smooth displacements of whole patches of a surface, in which its linear system is small.
#pragma once

#include <Eigen/Sparse>
#include <cstdint>
#include <dynmesh/topology.hpp>
#include <dynmesh/types.hpp>
#include <span>
#include <vector>

#include "base/workers.hpp"
#include "mesh/ties.hpp"
#include "shape/rotations.hpp"
#include "surface_fit/surface_rows.hpp"

namespace dynmesh {

/// The second level of a preconditioner of A = (N + rows): A^-1 is approximated by
/// Psi (Psi^T A Psi)^-1 Psi^T, beside a sparse factor that treats the three coordinates alike
/// (smoothed aggregation, Vanek, Mandel and Brezina 1996; additive Schwarz). Points resist only
/// along their normals, so a limb slides along itself with hardly any resistance, and conjugate
/// gradients with that factor alone find such motions of large patches last.
///
/// Each patch is a cluster of clusters, of about 50 vertices, and its function is 1 in it, averaged
/// over one-rings until it is smooth; the functions add up to 1 at each vertex. Allocates memory in
/// the constructor, and in `factorize`.
class CoarseSpace {
 public:
  using Matrix = Eigen::SparseMatrix<double>;

  /// `clusters` are those of frame 0, `normal` is N without ties.
  CoarseSpace(const Cells& cells, Field first_frame, const Clusters& clusters, const Matrix& normal,
              std::span<const Tie> ties);

  /// Factors the small system for rows whose weights are multiplied by `factor`. `held` (k,) are
  /// further weights, of the three coordinates alike. `ties` differ from those of the constructor
  /// in their weights alone.
  void factorize(std::span<const SurfaceRow> rows, double factor, std::span<const double> held,
                 std::span<const Tie> ties);

  /// Adds the approximation of A^-1 times `residual` (k,) to `x` (k,).
  void add(Field residual, std::span<Vector3> x, Workers& workers);

 private:
  using Functions = Eigen::SparseMatrix<double, Eigen::RowMajor>;
  using Blocks = std::vector<Eigen::Matrix3d>;

  [[nodiscard]] Matrix with_blocks(const Matrix& n, const Blocks& blocks) const;
  void add_ties(std::span<const Tie> ties, Matrix& n) const;

  Functions psi_;
  Functions transposed_;  // of which threads take rows
  // The lower triangle of Psi^T N Psi, in which the three coordinates are alike, with an entry
  // wherever there is one for N with ties.
  Matrix n_;
  // Of each two patches whose functions meet at a vertex, the number of their entry in n_.
  std::vector<std::uint32_t> entry_of_;
  Eigen::SimplicialLLT<Matrix> factor_;
};

}  // namespace dynmesh
