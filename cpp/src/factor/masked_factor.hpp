/// Solves linear systems with principal submatrices of a fixed matrix.
#pragma once

#include <algorithm>
#include <atomic>
#include <cstddef>
#include <cstdint>
#include <dynmesh/types.hpp>
#include <memory>
#include <span>
#include <vector>

#include "factor/elimination.hpp"
#include "kernels/kernels.hpp"
#include "support/geometry.hpp"
#include "support/workers.hpp"

namespace dynmesh {

/// The number of rows of a product of panels that are computed at once, so that they stay in the
/// first-level cache.
constexpr Index rows_of_product = 128;

/// What a thread of a factorisation needs for itself.
struct Workspace {
  explicit Workspace(std::size_t n) : local(n) {}

  std::vector<Index> local;  // (n,) the row of the current panel for each row of the submatrix
  std::vector<double> products = std::vector<double>(rows_of_product * widest_supernode);
  std::vector<double> packed = std::vector<double>(most_work);
};

/// One workspace for each thread. Which of them a thread gets has no effect on its results.
class Workspaces {
 public:
  Workspaces(Index threads, std::size_t n)
      : workspaces_(static_cast<std::size_t>(threads), Workspace(n)),
        is_lent_(std::make_unique<std::atomic<bool>[]>(workspaces_.size())) {}

  /// Calls `work` with a workspace that no other thread uses meanwhile. At most as many threads may
  /// do so at a time as there are workspaces.
  template <class Work>
  void lend(const Work& work) {
    std::size_t i = 0;
    while (is_lent_[i].exchange(true, std::memory_order_acquire)) i = (i + 1) % workspaces_.size();
    work(workspaces_[i]);
    is_lent_[i].store(false, std::memory_order_release);
  }

 private:
  std::vector<Workspace> workspaces_;
  std::unique_ptr<std::atomic<bool>[]> is_lent_;
};

/// A supernodal Cholesky factorisation (left-looking, as in Chen, Davis, Hager and Rajamanickam
/// 2008). Its order and supernodes are computed for the whole matrix, and each mask selects a part
/// of them.
///
/// If the factorisation takes long (TaskSharing::factor_from), subtrees of the elimination forest
/// are factored by different threads, and then the panels above them by one. The results do not
/// depend on the number of threads.
class MaskedFactor {
 public:
  /// `matrix` must be positive semidefinite. `workers` must outlive this object.
  MaskedFactor(const SparseMatrix& matrix, Workers& workers,
               const Kernels& kernels = best_kernels());

  /// Reserves address space for the largest factor that any mask can have, so that `factorize`
  /// allocates none. The memory itself is only used as far as a factor fills it.
  void reserve();

  /// Factors the rows and columns with `mask[i] != 0`, after adding `added` (n,) to the diagonal
  /// unless it is empty. If both are the same as in the last call, keeps the factor and returns
  /// false; otherwise returns true. Allocates memory only if the factor is larger than ever before.
  bool factorize(std::span<const std::uint8_t> mask, std::span<const double> added = {});

  /// What the last factor cost: how many multiplications it took, about, and how many numbers it
  /// has.
  struct Cost {
    double multiplications = 0;
    double entries = 0;
  };
  [[nodiscard]] const Cost& cost() const { return cost_; }

  /// The factored rows and columns, in elimination order.
  [[nodiscard]] std::span<const Index> order() const { return order_; }

  /// Replaces right-hand sides by the solutions. There are one or three `fields` for each row of
  /// `order()`. Directions in which the submatrix is singular in double precision have no part in
  /// the solution.
  void solve(std::span<Vector3<double>> values, int fields);

  /// The same with the factor in single precision, which is faster where one factor solves many
  /// systems. What it multiplies by is symmetric and positive semidefinite, as conjugate gradients
  /// need it, whatever the rounding. Allocates memory as `factorize` does.
  void precondition(std::span<Vector3<double>> values, int fields);

 private:
  struct Panel {
    Index first;  // its first row in the submatrix, in elimination order
    Index columns;
    Index below;  // the rows below its triangle are rows_[below] to rows_[below + n_below - 1]
    Index n_below;
    Index n_inside;    // those of them that are not above the panel's subtree, if it is in one
    std::size_t data;  // the index of its first entry in factor_
    std::size_t rounded = 0;  // the same in rounded_

    [[nodiscard]] Index rows() const { return columns + n_below; }
  };
  /// The panels of a subtree, and the rows above it in which they have entries.
  struct Border {
    Index first_panel;
    Index end_panel;
    Index end_row;  // the first row of the submatrix that is not in the subtree
    Index first;    // the rows are border_rows_[first] to border_rows_[end - 1]
    Index end;
    Index unfinished;  // the first of a list of panels with such rows, linked by next_
  };

  // masked_factor.cpp, with solve_forward and solve_backward
  void thin_out(std::span<const std::uint8_t> mask);
  void find_rows(Index supernode);
  void divide();

  // factorization.cpp
  void factor(Index panel, Border* border, Workspace& workspace);
  void fill(const Panel& panel, std::vector<Index>& local);
  [[nodiscard]] Index n_common(Index descendant, const Panel& panel) const;
  void subtract(const Panel& panel, Index descendant, Index n, Workspace& workspace);
  void factor_triangle(const Panel& panel, Workspace& workspace);
  void queue(Index panel, Index row, Border* border);
  void number_border(const Border& border, std::vector<Index>& local);

  void solve_forward(const Panel& panel, double* values, double* sums, int fields) const;
  void solve_backward(const Panel& panel, double* values, int fields) const;

  // rounded_solves.cpp
  void round();
  void round(const Panel& panel);
  void forward_rounded(const Panel& panel, double* values, Index stride, double* sums) const;
  void backward_rounded(const Panel& panel, double* values, Index stride) const;

  /// Calls `forward(panel, sums)` for all panels and then `backward(panel)` in reverse, for
  /// right-hand sides with `width` fields that begin `stride` apart. Subtrees are shared if it is
  /// worth it, so the forward steps add up in `sums` what they contribute to the rows above their
  /// subtree, to which others contribute at the same time.
  template <class Forward, class Backward>
  void pass(Vector3<double>* values, std::size_t stride, std::size_t width, const Forward& forward,
            const Backward& backward) {
    const bool is_worth_it =
        cost_.entries * static_cast<double>(width) >= workers_.task_sharing().solve_from;
    for_each_subtree(is_worth_it, [&](Border& border) {
      Vector3<double>* sums = border_sums_.data() + 3 * border.first;
      std::fill_n(sums, at(border.end - border.first) * width, Vector3<double>{});
      for (Index p = border.first_panel; p < border.end_panel; ++p) forward(panels_[p], &sums->x);
    });
    for (const Border& border : borders_) {
      const Vector3<double>* sums = border_sums_.data() + 3 * border.first;
      for (Index i = border.first; i < border.end; ++i) {
        Vector3<double>* row = values + at(border_rows_[i]) * stride;
        for (std::size_t f = 0; f < width; ++f) row[f] = row[f] + *sums++;
      }
    }
    for (const Index p : above_) forward(panels_[p], nullptr);
    for (auto p = above_.rbegin(); p != above_.rend(); ++p) backward(panels_[*p]);
    for_each_subtree(is_worth_it, [&](Border& border) {
      for (Index p = border.end_panel; p-- > border.first_panel;) backward(panels_[p]);
    });
  }

  /// Calls `work(border)` for each subtree, sharing them if it is worth it.
  template <class Work>
  void for_each_subtree(bool is_worth_it, const Work& work) {
    workers_.share(static_cast<Index>(borders_.size()), is_worth_it,
                   [&](Index i) { work(borders_[i]); });
  }

  SparseMatrix matrix_;  // rows and columns by positions
  Elimination plan_;
  const Kernels& kernels_;
  Workers& workers_;
  Subtrees subtrees_;
  Workspaces workspaces_;
  std::vector<double> least_pivots_;  // (n,) by positions

  std::vector<std::uint8_t> mask_;
  std::vector<double> added_;
  std::vector<Index> row_of_;  // (n,) row of the submatrix at each position, -1 where masked out
  std::vector<Index> order_;
  std::vector<Index> position_at_;  // the position of each row of the submatrix
  std::vector<Index> panel_of_;     // the panel of each row of the submatrix
  std::vector<Index>
      panels_before_;  // (supernodes + 1,) the number of panels before each supernode
  std::vector<Panel> panels_;
  std::vector<Index> rows_;
  std::vector<double> factor_;
  std::vector<double> inverse_;  // the inverse of the diagonal of the factor
  std::vector<float> rounded_;   // of rounded_solves.cpp
  bool is_rounded_ = false;
  Cost cost_;

  std::vector<Index> above_;                  // the panels that are in no subtree
  std::vector<Border> borders_;               // (subtrees,)
  std::vector<Index> border_rows_;            // ascending in each border
  std::vector<Index> in_border_;              // by rows_: the index in the border of its subtree
  std::vector<Vector3<double>> border_sums_;  // of solve_forward, three for each row of a border

  // For the construction of panels:
  std::vector<Index> seen_;  // (n,) by positions: the last supernode with an entry in that row
  std::vector<Index> first_child_;  // (supernodes,) the first panel whose first row below the
                                    // triangle is in the supernode
  std::vector<Index> sibling_;
  std::vector<double> multiplications_;  // (supernodes,)
  std::vector<Index> next_;  // (panels,) linked lists of the panels that contribute to a later one
  std::vector<Index> head_;
  std::vector<Index> reached_;  // (panels,) how many rows below the triangle have been processed
};

}  // namespace dynmesh
