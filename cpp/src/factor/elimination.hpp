/// The elimination order of a sparse symmetric matrix, both triangles of which are stored, and the
/// blocks of its factor. They are computed once for the whole matrix and used for any of its
/// principal submatrices.
#pragma once

#include <Eigen/SparseCore>
#include <cstddef>
#include <dynmesh/types.hpp>
#include <span>
#include <vector>

namespace dynmesh {

using SparseMatrix = Eigen::SparseMatrix<double, Eigen::ColMajor, Index>;

/// Returns the column at each position: approximate minimum degree (Amestoy, Davis and Duff 1996).
/// It depends only on where the matrix has entries.
std::vector<Index> elimination_order(const SparseMatrix& matrix);

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
Elimination plan_elimination(const SparseMatrix& matrix);

/// Supernodes `first` to `root`: all below `root` in the elimination forest, which affect no others
/// but those above it.
struct Subtree {
  Index first;
  Index root;
};

/// Disjoint subtrees of about equal work. All other supernodes are above them, and come after them.
/// The division depends on the matrix and the mask only, so that the results do not depend on the
/// number of threads.
class Subtrees {
 public:
  explicit Subtrees(const Elimination& plan);

  /// Takes the largest subtrees whose work is a small share of all. `work` is that of each
  /// supernode, and is replaced by that of its subtree. Allocates no memory.
  void divide(std::span<double> work);
  /// No subtrees at all.
  void clear();

  /// In ascending order.
  [[nodiscard]] std::span<const Subtree> all() const { return subtrees_; }

 private:
  std::span<const Index> parents_;
  std::vector<Index> firsts_;  // the first supernode below each one, or -1 if they are not adjacent
  std::vector<Subtree> subtrees_;
};

}  // namespace dynmesh
