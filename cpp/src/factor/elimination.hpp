/// The order in which a sparse symmetric matrix is factored, and the blocks that its factor falls
/// into: found once for the whole matrix, used for any of its principal submatrices.
#pragma once

#include <dynmesh/types.hpp>
#include <span>
#include <vector>

namespace dynmesh {

/// A sparse symmetric matrix: both triangles, rows ascending in each column.
struct SymmetricMatrix {
  std::vector<Index> offsets;
  std::vector<Index> rows;
  std::vector<double> values;

  [[nodiscard]] std::size_t size() const { return offsets.size() - 1; }
};

/// Places are positions in the order of elimination. Supernode s is the columns at positions
/// firsts[s] to firsts[s + 1] - 1; below them the factor may have entries in the rows at positions
/// rows[row_offsets[s]] to rows[row_offsets[s + 1] - 1], ascending, and in no others, whichever
/// rows and columns of the matrix are left out (Rose, Tarjan and Lueker 1976: a submatrix fills in
/// where the whole does, or less).
struct Elimination {
  std::vector<Index> column_at;    ///< (n,) the column at each position
  std::vector<Index> position_of;  ///< (n,) the position of each column
  std::vector<Index> firsts;
  std::vector<Index> row_offsets;
  std::vector<Index> rows;

  [[nodiscard]] Index supernodes() const { return static_cast<Index>(firsts.size()) - 1; }
};

/// Approximate minimum degree; columns with nearly the same rows share a supernode, of at most
/// `widest_supernode` columns (dense_kernels.hpp).
Elimination plan_elimination(const SymmetricMatrix& matrix);

}  // namespace dynmesh
