/// Solves linear systems with principal submatrices of a fixed matrix.
#pragma once

#include <cstddef>
#include <cstdint>
#include <dynmesh/types.hpp>
#include <span>
#include <vector>

#include "factor/elimination.hpp"
#include "kernels/kernels.hpp"

namespace dynmesh {

/// A supernodal Cholesky factorisation (left-looking, as in Chen, Davis, Hager and Rajamanickam
/// 2008). Its order and supernodes are computed for the whole matrix, and each mask selects a part
/// of them.
class MaskedFactor {
 public:
  /// `matrix` must be positive semidefinite.
  explicit MaskedFactor(SymmetricMatrix matrix, const DenseKernels& kernels = best_kernels().dense);

  /// Factors the rows and columns with `mask[i] != 0`, after adding `added` (n,) to the diagonal
  /// unless it is empty. If both are the same as in the last call, keeps the factor and returns
  /// false; otherwise returns true. Allocates memory only if the factor is larger than all earlier
  /// ones.
  bool factorize(std::span<const std::uint8_t> mask, std::span<const double> added = {});

  /// The factored rows and columns, in elimination order.
  [[nodiscard]] std::span<const Index> order() const { return order_; }

  /// Replaces right-hand sides by the solutions. There are one or three `fields` for each row of
  /// `order()`. Directions in which the submatrix is singular in double precision have no part in
  /// the solution.
  void solve(std::span<Vector3<double>> values, int fields) const;

 private:
  struct Panel {
    Index first;  // its first row in the submatrix, in elimination order
    Index columns;
    Index below;  // the rows below its triangle are rows_[below] to rows_[below + n_below - 1]
    Index n_below;
    std::size_t data;  // the index of its first entry in factor_
  };

  void thin_out(std::span<const std::uint8_t> mask);
  void find_rows(Index supernode);
  void fill(const Panel& panel);
  void subtract_descendants(Index panel);
  void queue(Index panel, Index row);

  SymmetricMatrix matrix_;  // rows and columns by positions
  Elimination plan_;
  const DenseKernels& kernels_;
  std::vector<double> least_pivots_;  // (n,) by positions

  std::vector<std::uint8_t> mask_;
  std::vector<double> added_;
  std::vector<Index> row_of_;  // (n,) row of the submatrix at each position, -1 where masked out
  std::vector<Index> order_;
  std::vector<Index> position_at_;  // the position of each row of the submatrix
  std::vector<Index> panel_of_;     // the panel of each row of the submatrix
  std::vector<Panel> panels_;
  std::vector<Index> rows_;
  std::vector<double> factor_;
  std::vector<double> inverse_;  // the inverse of the diagonal of the factor

  // For the construction of panels:
  std::vector<Index> seen_;  // (n,) by positions: the last supernode with an entry in that row
  std::vector<Index> first_child_;  // (supernodes,) the first panel whose first row below the
                                    // triangle is in the supernode
  std::vector<Index> sibling_;
  std::vector<Index> local_;  // the row of the panel for each row of the submatrix
  std::vector<Index> next_;   // (panels,) linked lists of the panels that contribute to a later one
  std::vector<Index> head_;
  std::vector<Index> reached_;  // (panels,) how many rows below the triangle have been processed
  std::vector<double> products_;
  std::vector<double> work_;
};

}  // namespace dynmesh
