#include "factor/masked_factor.hpp"

#include <algorithm>
#include <numeric>
#include <utility>

#include "support/geometry.hpp"

namespace dynmesh {
namespace {

/// Pivots below this fraction of the diagonal of the matrix are zero except for rounding errors.
constexpr double singular = 1e-14;

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
    const auto own = at(plan.row_offsets[s + 1] - plan.row_offsets[s]);
    const Index parent = plan.parents[s];
    (parent < 0 ? of_roots : below[parent]) += std::max(own, below[s]);
  }
  return of_roots;
}

}  // namespace

MaskedFactor::MaskedFactor(const SparseMatrix& matrix, Workers& workers, const Kernels& kernels)
    : plan_(plan_elimination(matrix)),
      kernels_(kernels),
      workers_(workers),
      subtrees_(plan_),
      workspaces_(workers.threads(), plan_.column_at.size()) {
  matrix_ = permuted(matrix, plan_);
  const std::size_t n = plan_.column_at.size();
  least_pivots_.resize(n);
  for (Index j = 0; j < static_cast<Index>(n); ++j) {
    least_pivots_[j] = singular * matrix_.coeff(j, j);
  }
  const auto supernodes = at(plan_.supernodes());
  mask_.reserve(n);
  added_.reserve(n);
  row_of_.resize(n);
  position_at_.reserve(n);
  order_.reserve(n);
  panel_of_.resize(n);
  panels_before_.reserve(supernodes + 1);
  panels_.reserve(supernodes);
  rows_.resize(plan_.rows.size());
  inverse_.resize(n);
  above_.reserve(supernodes);
  borders_.reserve(supernodes);
  border_rows_.reserve(largest_borders(plan_));
  border_sums_.reserve(3 * border_rows_.capacity());
  in_border_.resize(plan_.rows.size());
  seen_.resize(n);
  first_child_.resize(supernodes);
  sibling_.resize(supernodes);
  multiplications_.resize(supernodes);
  next_.resize(supernodes);
  head_.resize(supernodes);
  reached_.resize(supernodes);
}

void MaskedFactor::reserve() {
  std::size_t size = 0;
  for (std::size_t s = 0; s < at(plan_.supernodes()); ++s) {
    const auto columns = at(plan_.firsts[s + 1] - plan_.firsts[s]);
    size += columns * (columns + at(plan_.row_offsets[s + 1] - plan_.row_offsets[s]));
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
    panels_.push_back({begin, first - begin, below, 0, 0, size});
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
  cost_.entries = static_cast<double>(size);
  divide();
}

/// Divides the panels among subtrees.
void MaskedFactor::divide() {
  cost_.multiplications = std::accumulate(multiplications_.begin(), multiplications_.end(), 0.0);
  const TaskSharing& sharing = workers_.task_sharing();
  if (workers_.are_worth_it(static_cast<Index>(row_of_.size())) &&
      cost_.multiplications >= sharing.factor_from) {
    subtrees_.divide(multiplications_);
  } else {
    subtrees_.clear();
  }
  above_.clear();
  borders_.clear();
  border_rows_.clear();
  const auto n_panels = static_cast<Index>(panels_.size());
  Index next = 0;
  for (const Subtree& subtree : subtrees_.all()) {
    const auto root = at(subtree.root);
    Border border = {panels_before_[subtree.first],
                     panels_before_[root + 1],
                     0,
                     static_cast<Index>(border_rows_.size()),
                     0,
                     none};
    const bool is_empty = border.first_panel == border.end_panel;
    for (Index r = plan_.row_offsets[root]; r < plan_.row_offsets[root + 1] && !is_empty; ++r) {
      const Index row = row_of_[plan_.rows[r]];
      if (row != none) border_rows_.push_back(row);
    }
    border.end = static_cast<Index>(border_rows_.size());
    border.end_row = border.end_panel < n_panels ? panels_[border.end_panel].first
                                                 : static_cast<Index>(order_.size());
    borders_.push_back(border);
    for (; next < border.first_panel; ++next) above_.push_back(next);
    next = border.end_panel;
  }
  for (; next < n_panels; ++next) above_.push_back(next);
  for (const Index p : above_) panels_[p].n_inside = panels_[p].n_below;
  if (border_sums_.size() < 3 * border_rows_.size()) border_sums_.resize(3 * border_rows_.size());
}

/// Selects the rows of the current panel: those of its columns and of its children that the mask
/// contains.
void MaskedFactor::find_rows(Index supernode) {
  const auto s = at(supernode);
  Panel& panel = panels_.back();
  const auto mine = static_cast<Index>(panels_.size()) - 1;
  for (Index j = panel.first; j < panel.first + panel.columns; ++j) {
    for (SparseMatrix::InnerIterator e(matrix_, position_at_[j]); e; ++e) seen_[e.row()] = mine;
  }
  for (Index child = first_child_[s]; child != none; child = sibling_[child]) {
    const Panel& below = panels_[child];
    for (Index r = below.below; r < below.below + below.n_below; ++r) {
      seen_[position_at_[rows_[r]]] = mine;
    }
  }
  for (Index r = plan_.row_offsets[s]; r < plan_.row_offsets[s + 1]; ++r) {
    const auto position = at(plan_.rows[r]);
    const Index row = row_of_[position];
    rows_[panel.below + panel.n_below] = row;
    panel.n_below += static_cast<Index>(seen_[position] == mine) & static_cast<Index>(row != none);
  }
  if (panel.n_below == 0) return;
  const Index position = position_at_[rows_[panel.below]];
  const auto up = std::upper_bound(plan_.firsts.begin(), plan_.firsts.end(), position) -
                  plan_.firsts.begin() - 1;
  sibling_[mine] = first_child_[up];
  first_child_[up] = mine;
}

void MaskedFactor::solve(std::span<Vector3<double>> values, int fields) {
  double* numbers = &values[0].x;
  pass(
      values.data(), at(fields), at(fields),
      [&](const Panel& panel, double* sums) { solve_forward(panel, numbers, sums, fields); },
      [&](const Panel& panel) { solve_backward(panel, numbers, fields); });
}

/// Solves for the rows of a panel. The `sums` are those of its subtree.
void MaskedFactor::solve_forward(const Panel& panel, double* values, double* sums,
                                 int fields) const {
  kernels_.dense.solve_forward(&factor_[panel.data], panel.columns + panel.n_inside, panel.columns,
                               &inverse_[panel.first], panel.first, rows_.data() + panel.below,
                               values, fields);
  const Index n_above = panel.n_below - panel.n_inside;
  if (n_above == 0) return;
  const double* rows =
      &factor_[panel.data + at(panel.columns + panel.n_inside) * at(panel.columns)];
  kernels_.dense.subtract_products(rows, n_above, panel.columns,
                                   values + static_cast<std::ptrdiff_t>(panel.first) * 4 * fields,
                                   &in_border_[panel.below + panel.n_inside], sums, fields);
}

void MaskedFactor::solve_backward(const Panel& panel, double* values, int fields) const {
  kernels_.dense.solve_backward(&factor_[panel.data], panel.rows(), panel.columns,
                                &inverse_[panel.first], panel.first, rows_.data() + panel.below,
                                values, fields);
}

}  // namespace dynmesh
