/// Solves linear systems with principal submatrices of a fixed matrix.
#pragma once

#include <Eigen/SparseCore>
#include <array>
#include <cstddef>
#include <cstdint>
#include <dynmesh/types.hpp>
#include <memory>
#include <mutex>
#include <span>
#include <vector>

#include "base/geometry.hpp"
#include "base/workers.hpp"
#include "kernels/kernels.hpp"

namespace dynmesh {

using SparseMatrix = Eigen::SparseMatrix<double, Eigen::ColMajor, Index>;

/// The elimination order of a sparse symmetric matrix, both triangles of which are stored, and the
/// blocks of its factor, for any of its principal submatrices.
///
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
  /// The first of the supernodes below each one in the forest, which are all that precede it from
  /// there on, and affect no others but those above it.
  std::vector<Index> subtree_firsts;

  [[nodiscard]] Index supernodes() const { return static_cast<Index>(firsts.size()) - 1; }
};

/// Orders the columns. Those with nearly the same rows form a supernode of at most
/// `widest_supernode` columns (dense_kernels.hpp).
Elimination plan_elimination(const SparseMatrix& matrix);

/// A positive semidefinite matrix in the order of its elimination, which several factors share.
struct FactorPlan {
  explicit FactorPlan(const SparseMatrix& of);
  /// In the order of another matrix, which has entries in the same places.
  FactorPlan(const SparseMatrix& of, std::shared_ptr<const Elimination> order);

  std::shared_ptr<const Elimination> elimination;
  SparseMatrix matrix;               ///< the lower triangle, rows and columns by positions
  std::vector<double> least_pivots;  ///< (n,) by positions
};

/// A supernodal Cholesky factorisation (left-looking, as in Chen, Davis, Hager and Rajamanickam
/// 2008). Its order and supernodes are computed for the whole matrix, and each mask selects a part
/// of them.
///
/// If the factorisation takes long, subtrees of the elimination forest are factored by different
/// threads, and then the panels above them by one. The results do not depend on the number of
/// threads.
class MaskedFactor {
 public:
  /// `matrix` must be positive semidefinite. `workers` must outlive this object.
  MaskedFactor(const SparseMatrix& matrix, Workers& workers,
               const Kernels& kernels = best_kernels())
      : MaskedFactor(std::make_shared<const FactorPlan>(matrix), workers, kernels) {}
  /// Of a matrix that several factors share.
  MaskedFactor(std::shared_ptr<const FactorPlan> plan, Workers& workers,
               const Kernels& kernels = best_kernels());

  [[nodiscard]] const std::shared_ptr<const FactorPlan>& plan() const { return shared_; }

  /// Reserves address space for the largest factor that any mask can have, so that `factorize`
  /// allocates none. The memory itself is only used as far as a factor fills it.
  void reserve();

  /// Factors the rows and columns with `mask[i] != 0`, after adding `added` (n,) to the diagonal
  /// unless it is empty. If both are the same as in the last call, keeps the factor and returns
  /// false; otherwise returns true. Allocates memory only if the factor is larger than ever before.
  bool factorize(std::span<const std::uint8_t> mask, std::span<const double> added = {});

  /// The factored rows and columns, in elimination order.
  [[nodiscard]] std::span<const Index> order() const { return order_; }

  /// Replaces right-hand sides by the solutions. There are one or three `fields` for each row of
  /// `order()`. Directions in which the submatrix is singular in double precision have no part in
  /// the solution.
  void solve(std::span<Vector3> values, int fields);

  /// Rounds the factor to single precision, in which most of its time is that of loading it, for
  /// `solve_rounded`.
  void round();
  /// As `solve` with the rounded factor: `values` has four numbers for each row of `order()`, the
  /// last of which has no meaning.
  void solve_rounded(std::span<float> values);

 private:
  struct Panel {
    Index first;  // its first row in the submatrix, in elimination order
    Index columns;
    Index below;       // the rows below its triangle are rows_[below] to rows_[below + n_below - 1]
    std::size_t data;  // the index of its first entry in factor_
    Index n_below = 0;
    Index n_inside = 0;    // those of them that are not above the panel's subtree, if it has one
    Index sibling = none;  // the next panel whose first row below the triangle is in the supernode
    // A list of the earlier panels that contribute to this one.
    Index head = none;
    Index next = none;
    Index reached = 0;  // how many rows below the triangle have been processed

    [[nodiscard]] Index rows() const { return columns + n_below; }
  };
  /// The panels of a subtree, and the rows above it in which they have entries.
  struct Border {
    Index first_panel;
    Index end_panel;
    Index first;  // the rows are border_rows_[first] to border_rows_[end - 1]
    Index end;
    Index unfinished = none;  // the first of a list of panels with such rows
  };
  /// What a thread of a factorisation needs for itself. Which of them it gets has no effect on the
  /// results.
  struct Workspace {
    /// So many rows of a product of panels are computed at once, to stay in the first-level cache.
    static constexpr Index rows_of_product = 128;

    std::mutex is_lent;
    std::vector<Index> local;  // (n,) the row of the current panel for each row of the submatrix
    std::array<double, at(widest_supernode)> least_pivots{};
    std::array<double, at(rows_of_product) * at(widest_supernode)> products{};
    std::array<double, at(most_work)> packed{};
  };

  // masked_factor.cpp
  void thin_out(std::span<const std::uint8_t> mask);
  void find_rows(Index supernode);
  void divide();

  // solves.cpp
  template <class Real>
  void solve_with(const SolveKernels<Real>& kernels, const Real* factor, const Real* inverses,
                  Real* border_sums, Real* numbers, int fields);

  // factorization.cpp
  void factor(Index panel, Border* border, Workspace& workspace);
  void fill(const Panel& panel, Workspace& workspace);
  Index subtract(const Panel& panel, const Panel& descendant, Workspace& workspace);
  void queue(Index panel, Index row, Border* border);
  void number_border(const Border& border, std::vector<Index>& local);

  /// Calls `work(border)` for each subtree, sharing them if it is worth it.
  template <class Work>
  void for_each_subtree(bool is_worth_it, const Work& work) {
    workers_.share(static_cast<Index>(borders_.size()), is_worth_it,
                   [&](Index i) { work(borders_[i]); });
  }
  /// Calls `work` with a workspace that no other thread uses meanwhile. There is one for each.
  template <class Work>
  void lend_workspace(const Work& work) {
    std::size_t i = 0;
    while (!workspaces_[i].is_lent.try_lock()) i = (i + 1) % workspaces_.size();
    const std::lock_guard is_lent(workspaces_[i].is_lent, std::adopt_lock);
    work(workspaces_[i]);
  }

  std::shared_ptr<const FactorPlan> shared_;
  const SparseMatrix& matrix_;  // its members
  const Elimination& plan_;
  const Kernels& kernels_;
  Workers& workers_;
  std::vector<Workspace> workspaces_;

  std::vector<std::uint8_t> mask_;
  std::vector<double> added_;
  std::vector<Index> row_of_;  // (n,) row of the submatrix at each position, -1 where masked out
  std::vector<Index> order_;
  std::vector<Index> position_at_;    // the position of each row of the submatrix
  std::vector<Index> panel_of_;       // the panel of each row of the submatrix
  std::vector<Index> panels_before_;  // (supernodes + 1,) how many there are before each supernode
  std::vector<Panel> panels_;
  std::vector<Index> rows_;
  std::vector<double> factor_;
  std::vector<double> inverse_;  // the inverse of the diagonal of the factor
  std::size_t n_entries_ = 0;    // of the factor
  std::vector<float> rounded_, rounded_inverse_, rounded_sums_;  // after `round`

  std::vector<Index> above_;          // the panels that are in no subtree
  std::vector<Border> borders_;       // those of the subtrees
  std::vector<Index> border_rows_;    // ascending in each border
  std::vector<Index> in_border_;      // by rows_: the index in the border of its subtree
  std::vector<Vector3> border_sums_;  // of forward steps, three for each row of a border

  // For the construction of panels:
  std::vector<Index> seen_;         // (n,) by positions: the last panel with an entry in that row
  std::vector<Index> first_child_;  // (supernodes,) the first panel whose first row below the
                                    // triangle is in the supernode
  std::vector<double> multiplications_;  // (supernodes,)
};

}  // namespace dynmesh
