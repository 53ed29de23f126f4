/// The elimination order of a sparse symmetric matrix, both triangles of which are stored, and the
/// blocks of its factor. They are computed once for the whole matrix and used for any of its
/// principal submatrices.
#pragma once

#include <Eigen/SparseCore>
#include <dynmesh/types.hpp>
#include <vector>

namespace dynmesh {

using SparseMatrix = Eigen::SparseMatrix<double, Eigen::ColMajor, Index>;

/// A position is an index in the elimination order. Supernode s consists of the columns at
/// positions firsts[s] to firsts[s + 1] - 1. Below them, the factor can have entries only in the
/// rows at the positions rows[s], which are ascending. This also holds if any rows and columns of
/// the matrix are removed (Rose, Tarjan and Lueker 1976: the fill-in of a submatrix is contained in
/// that of the whole matrix).
struct Elimination {
  std::vector<Index> column_at;    ///< (n,) the column at each position
  std::vector<Index> position_of;  ///< (n,) the position of each column
  std::vector<Index> firsts;
  std::vector<Index> supernode_of;  ///< (n,) the supernode of each position
  std::vector<std::vector<Index>> rows;
  /// The supernode of the first row below each supernode, none for the last one of a component: the
  /// elimination forest. Children precede their parents.
  std::vector<Index> parents;
  /// The first of the supernodes below each one in the forest, which affect no others but those
  /// above it, or none if these are not adjacent.
  std::vector<Index> subtree_firsts;

  [[nodiscard]] Index supernodes() const { return static_cast<Index>(firsts.size()) - 1; }
};

/// Orders the columns. Those with nearly the same rows form a supernode of at most
/// `widest_supernode` columns (dense_kernels.hpp).
Elimination plan_elimination(const SparseMatrix& matrix);

}  // namespace dynmesh
