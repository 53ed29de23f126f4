/// Linear systems with a principal submatrix of one matrix that never changes.
#pragma once

#include <cstddef>
#include <cstdint>
#include <dynmesh/types.hpp>
#include <span>
#include <vector>

#include "factor/elimination.hpp"
#include "kernels/dense_kernels.hpp"

namespace dynmesh {

/// A supernodal Cholesky factorisation (left-looking, as in Chen, Davis, Hager and Rajamanickam
/// 2008) whose order and supernodes come from the whole matrix and are thinned out by the mask.
class MaskedFactor {
 public:
  /// `matrix` must be positive semidefinite.
  explicit MaskedFactor(SymmetricMatrix matrix,
                        const DenseKernels& kernels = *runnable_dense_kernels().front());

  /// Factors the rows and columns with `mask[i] != 0`, with `added` (n,) on the diagonal, unless it
  /// is empty, and returns true; or keeps the factor of the last call, where both are the same, and
  /// returns false. Allocates only where the factor is larger than all before.
  bool factorize(std::span<const std::uint8_t> mask, std::span<const double> added = {});

  /// The rows and columns that are factored, in the order of elimination.
  [[nodiscard]] std::span<const Index> order() const { return order_; }

  /// Replaces right-hand sides, one or three `fields` for each row of `order()`, by the solutions.
  /// Directions in which the submatrix is singular in double precision stay out of them.
  void solve(std::span<Vector3<double>> values, int fields) const;

 private:
  struct Panel {
    Index first;  // row of the submatrix, in the order of elimination, that it begins with
    Index columns;
    Index below;  // its rows further down are rows_[below] to rows_[below + n_below - 1]
    Index n_below;
    std::size_t data;  // where its numbers begin in factor_
  };

  void thin_out(std::span<const std::uint8_t> mask);
  void find_rows(Index supernode);
  void fill(const Panel& panel);
  void subtract_descendants(Index panel);
  void queue(Index panel, Index row);

  SymmetricMatrix matrix_;  // rows and columns by their positions
  Elimination plan_;
  const DenseKernels& kernels_;
  std::vector<double> least_pivots_;  // (n,) by positions

  std::vector<std::uint8_t> mask_;
  std::vector<double> added_;
  std::vector<Index> row_of_;  // (n,) row of the submatrix at each position, -1 where masked out
  std::vector<Index> order_;
  std::vector<Index> position_at_;  // the position of each row of the submatrix
  std::vector<Index> panel_of_;     // and its panel
  std::vector<Panel> panels_;
  std::vector<Index> rows_;
  std::vector<double> factor_;
  std::vector<double> inverse_;  // one over the diagonal of the factor

  // Of the panel in the making.
  std::vector<Index> seen_;         // (n,) by positions: the last supernode that has a row there
  std::vector<Index> first_child_;  // (supernodes,) panels whose first row below is in it
  std::vector<Index> sibling_;
  std::vector<Index> local_;  // row of the panel for a row of the submatrix
  std::vector<Index> next_;   // (panels,) lists of the panels that reach into a later one
  std::vector<Index> head_;
  std::vector<Index> reached_;  // (panels,) rows below that are done with
  std::vector<double> products_;
  std::vector<double> work_;
};

}  // namespace dynmesh
