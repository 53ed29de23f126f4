/// The elimination order of a sparse symmetric matrix and the blocks of its factor. They are
/// computed once for the whole matrix and used for any of its principal submatrices.
#pragma once

#include <cstddef>
#include <dynmesh/types.hpp>
#include <vector>

namespace dynmesh {

/// A sparse symmetric matrix. Both triangles are stored, with ascending rows in each column.
struct SymmetricMatrix {
  std::vector<Index> offsets;
  std::vector<Index> rows;
  std::vector<double> values;

  [[nodiscard]] std::size_t size() const { return offsets.size() - 1; }
};

enum class Ordering {
  minimum_degree,     ///< approximate minimum degree (Amestoy, Davis and Duff 1996), by Eigen
  nested_dissection,  ///< nested dissection (George 1973), by METIS (Karypis and Kumar 1998)
};

/// Whether this build has METIS.
bool has_nested_dissection();

/// The order that `plan_elimination` takes for a matrix of `size` columns: nested dissection for
/// large ones, if this build has it.
Ordering best_ordering(std::size_t size);

/// Returns the column at each position. It depends only on where the matrix has entries. Nested
/// dissection in a build without METIS is minimum degree.
std::vector<Index> elimination_order(const SymmetricMatrix& matrix, Ordering ordering);

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
