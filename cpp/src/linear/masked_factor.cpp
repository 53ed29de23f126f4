#include "linear/masked_factor.hpp"

#include <algorithm>
#include <numeric>
#include <utility>

namespace dynmesh {
namespace {

/// Pivots below this fraction of the diagonal of the matrix are zero except for rounding errors.
constexpr double singular = 1e-14;

/// A factorisation is divided into parts, which threads share, if they take part at all and it
/// takes at least this many multiplications for each vertex of a chunk.
constexpr double factor_from = 4e6 / 1024;

/// A subtree has at most this share of the work. With smaller ones, threads wait less for the last
/// of them, but more work is left above them.
constexpr double largest_share = 1.0 / 10;

/// The lower triangle, with rows and columns by positions.
SparseMatrix permuted(const SparseMatrix& matrix, const Elimination& plan) {
  std::vector<Eigen::Triplet<double, Index>> entries;
  for (const Index j : plan.column_at) {
    for (SparseMatrix::InnerIterator e(matrix, j); e; ++e) {
      const Index row = plan.position_of[e.row()];
      if (row >= plan.position_of[j]) entries.emplace_back(row, plan.position_of[j], e.value());
    }
  }
  SparseMatrix result(matrix.rows(), matrix.cols());
  result.setFromTriplets(entries.begin(), entries.end());
  return result;
}

/// The most rows that disjoint subtrees together have in common with what is above them.
std::size_t largest_borders(const Elimination& plan) {
  std::vector<std::size_t> below(at(plan.supernodes()));
  std::size_t of_roots = 0;
  for (std::size_t s = 0; s < below.size(); ++s) {
    const Index parent = plan.parents[s];
    (parent == none ? of_roots : below[parent]) += std::max(plan.rows[s].size(), below[s]);
  }
  return of_roots;
}

}  // namespace

FactorPlan::FactorPlan(const SparseMatrix& of)
    : FactorPlan(of, std::make_shared<const Elimination>(plan_elimination(of))) {}

FactorPlan::FactorPlan(const SparseMatrix& of, std::shared_ptr<const Elimination> order)
    : elimination(std::move(order)) {
  matrix = permuted(of, *elimination);
  for (Index j = 0; j < matrix.cols(); ++j) least_pivots.push_back(singular * matrix.coeff(j, j));
}

MaskedFactor::MaskedFactor(std::shared_ptr<const FactorPlan> plan, Workers& workers,
                           const Kernels& kernels)
    : shared_(std::move(plan)),
      matrix_(shared_->matrix),
      plan_(*shared_->elimination),
      kernels_(kernels),
      workers_(workers),
      workspaces_(at(workers.threads())) {
  const std::size_t n = plan_.column_at.size();
  for (Workspace& workspace : workspaces_) workspace.local.resize(n);
  std::size_t n_rows = 0;
  for (const auto& rows : plan_.rows) n_rows += rows.size();
  const auto supernodes = at(plan_.supernodes());
  mask_.reserve(n);
  added_.reserve(n);
  row_of_.resize(n);
  position_at_.reserve(n);
  order_.reserve(n);
  panel_of_.resize(n);
  panels_before_.reserve(supernodes + 1);
  panels_.reserve(supernodes);
  rows_.resize(n_rows);
  inverse_.resize(n);
  above_.reserve(supernodes);
  borders_.reserve(supernodes);
  border_rows_.reserve(largest_borders(plan_));
  border_sums_.reserve(3 * border_rows_.capacity());
  in_border_.resize(n_rows);
  seen_.resize(n);
  first_child_.resize(supernodes);
  multiplications_.resize(supernodes);
}

void MaskedFactor::reserve() {
  std::size_t size = 0;
  for (Index s = 0; s < plan_.supernodes(); ++s) {
    const std::size_t columns = at(plan_.firsts[s + 1] - plan_.firsts[s]);
    size += columns * (columns + plan_.rows[s].size());
  }
  factor_.reserve(size);
}

/// Determines the panels of the submatrix and their rows.
void MaskedFactor::thin_out(std::span<const std::uint8_t> mask) {
  // Here and below, no branch depends on the mask, since the processor could not predict it.
  const std::size_t n = row_of_.size();
  position_at_.resize(n);
  order_.resize(n);
  std::size_t size_of_order = 0;
  for (std::size_t position = 0; position < n; ++position) {
    const Index column = plan_.column_at[position];
    const bool is_in = mask[column] != 0;
    row_of_[position] = is_in ? static_cast<Index>(size_of_order) : none;
    position_at_[size_of_order] = static_cast<Index>(position);
    order_[size_of_order] = column;
    size_of_order += is_in ? 1 : 0;
  }
  position_at_.resize(size_of_order);
  order_.resize(size_of_order);
  panels_.clear();
  panels_before_.clear();
  std::ranges::fill(seen_, none);
  std::ranges::fill(first_child_, none);
  std::size_t size = 0;
  Index first = 0;
  Index below = 0;
  for (Index s = 0; s < plan_.supernodes(); ++s) {
    const Index end_position = plan_.firsts[s + 1];
    const Index begin = first;
    multiplications_[s] = 0;
    panels_before_.push_back(static_cast<Index>(panels_.size()));
    while (first < static_cast<Index>(position_at_.size()) && position_at_[first] < end_position) {
      panel_of_[first++] = static_cast<Index>(panels_.size());
    }
    if (first == begin) continue;
    panels_.push_back({.first = begin, .columns = first - begin, .below = below, .data = size});
    find_rows(s);
    const Panel& panel = panels_.back();
    below += panel.n_below;
    size += at(panel.columns) * at(panel.rows());
    multiplications_[s] = 0.5 * panel.columns * panel.rows() * panel.rows();
  }
  panels_before_.push_back(static_cast<Index>(panels_.size()));
  if (factor_.capacity() < size) {
    // The smaller one is freed first. The next masks may need a little more than this one.
    factor_ = std::vector<double>();
    factor_.reserve(size + size / 8);
  }
  if (factor_.size() < size) factor_.resize(size);
  n_entries_ = size;
  divide();
}

/// Takes the largest subtrees whose work is a small share of all. This depends on the matrix and
/// the mask only, so that the results do not depend on the number of threads.
void MaskedFactor::divide() {
  const double all = std::accumulate(multiplications_.begin(), multiplications_.end(), 0.0);
  const bool is_worth_it = workers_.are_worth_it(static_cast<Index>(row_of_.size())) &&
                           all >= factor_from * workers_.task_sharing().chunk;
  for (Index s = 0; s < plan_.supernodes(); ++s) {
    const Index up = plan_.parents[s];
    if (up != none) multiplications_[up] += multiplications_[s];
  }
  above_.clear();
  borders_.clear();
  border_rows_.clear();
  for (Index s = plan_.supernodes(); s-- > 0;) {
    const Index first = plan_.subtree_firsts[s];
    const bool is_subtree = is_worth_it && multiplications_[s] <= largest_share * all;
    const Index first_panel = panels_before_[is_subtree ? first : s];
    const Index end_panel = panels_before_[s + 1];
    if (is_subtree) {
      const auto begin = static_cast<Index>(border_rows_.size());
      for (const Index position : plan_.rows[s]) {
        if (row_of_[position] != none) border_rows_.push_back(row_of_[position]);
      }
      borders_.push_back({first_panel, end_panel, begin, static_cast<Index>(border_rows_.size())});
      s = first;
    } else if (first_panel < end_panel) {
      above_.push_back(first_panel);
      panels_[first_panel].n_inside = panels_[first_panel].n_below;
    }
  }
  std::ranges::reverse(above_);
  std::ranges::reverse(borders_);
  if (border_sums_.size() < 3 * border_rows_.size()) border_sums_.resize(3 * border_rows_.size());
}

/// Selects the rows of the current panel: those of its columns and of its children that the mask
/// contains.
void MaskedFactor::find_rows(Index s) {
  Panel& panel = panels_.back();
  const auto mine = static_cast<Index>(panels_.size()) - 1;
  for (Index j = panel.first; j < panel.first + panel.columns; ++j) {
    for (SparseMatrix::InnerIterator e(matrix_, position_at_[j]); e; ++e) seen_[e.row()] = mine;
  }
  for (Index child = first_child_[s]; child != none; child = panels_[child].sibling) {
    const Panel& below = panels_[child];
    for (Index r = below.below; r < below.below + below.n_below; ++r) {
      seen_[position_at_[rows_[r]]] = mine;
    }
  }
  for (const Index position : plan_.rows[s]) {
    const Index row = row_of_[position];
    rows_[panel.below + panel.n_below] = row;
    panel.n_below += static_cast<Index>(seen_[position] == mine) & static_cast<Index>(row != none);
  }
  if (panel.n_below == 0) return;
  Index& first_child = first_child_[plan_.supernode_of[position_at_[rows_[panel.below]]]];
  panel.sibling = first_child;
  first_child = mine;
}

}  // namespace dynmesh
