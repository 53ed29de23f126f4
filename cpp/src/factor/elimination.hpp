/// The elimination order of a sparse symmetric matrix and the blocks of its factor. They are
/// computed once for the whole matrix and used for any of its principal submatrices.
#pragma once

#include <dynmesh/types.hpp>
#include <vector>

#include "factor/elimination_order.hpp"
#include "factor/symmetric_matrix.hpp"

namespace dynmesh {

/// A position is an index in the elimination order. Supernode s consists of the columns at
/// positions firsts[s] to firsts[s + 1] - 1. Below them, the factor can have entries only in the
/// rows at positions rows[row_offsets[s]] to rows[row_offsets[s + 1] - 1], which are ascending.
/// This also holds if any rows and columns of the matrix are removed (Rose, Tarjan and Lueker 1976:
/// the fill-in of a submatrix is contained in that of the whole matrix).
struct Elimination {
  std::vector<Index> column_at;    ///< (n,) the column at each position
  std::vector<Index> position_of;  ///< (n,) the position of each column
  std::vector<Index> firsts;
  std::vector<Index> row_offsets;
  std::vector<Index> rows;
  /// The supernode of the first row below each supernode, -1 for the last one of a component: the
  /// elimination forest. Children precede their parents.
  std::vector<Index> parents;

  [[nodiscard]] Index supernodes() const { return static_cast<Index>(firsts.size()) - 1; }
};

/// Orders the columns. Those with nearly the same rows form a supernode of at most
/// `widest_supernode` columns (dense_kernels.hpp).
Elimination plan_elimination(const SymmetricMatrix& matrix, Ordering ordering);

}  // namespace dynmesh
