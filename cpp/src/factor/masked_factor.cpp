#include "factor/masked_factor.hpp"

#include <algorithm>
#include <array>
#include <utility>

namespace dynmesh {
namespace {

constexpr Index none = -1;

/// Pivots below this fraction of the diagonal of the matrix are zero except for rounding errors.
constexpr double singular = 1e-14;

std::size_t at(Index i) { return static_cast<std::size_t>(i); }

SymmetricMatrix permuted(const SymmetricMatrix& matrix, const Elimination& plan) {
  SymmetricMatrix result;
  result.offsets.push_back(0);
  std::vector<std::pair<Index, double>> column;
  for (const Index j : plan.column_at) {
    column.clear();
    for (Index e = matrix.offsets[at(j)]; e < matrix.offsets[at(j) + 1]; ++e) {
      column.emplace_back(plan.position_of[at(matrix.rows[at(e)])], matrix.values[at(e)]);
    }
    std::sort(column.begin(), column.end());
    for (const auto& [row, value] : column) {
      result.rows.push_back(row);
      result.values.push_back(value);
    }
    result.offsets.push_back(static_cast<Index>(result.rows.size()));
  }
  return result;
}

}  // namespace

MaskedFactor::MaskedFactor(SymmetricMatrix matrix, const DenseKernels& kernels)
    : plan_(plan_elimination(matrix)), kernels_(kernels) {
  matrix_ = permuted(matrix, plan_);
  const std::size_t n = matrix_.size();
  // Only the lower triangle is needed from here on.
  least_pivots_.resize(n);
  SymmetricMatrix lower;
  lower.offsets.push_back(0);
  for (std::size_t j = 0; j < n; ++j) {
    for (Index e = matrix_.offsets[j]; e < matrix_.offsets[j + 1]; ++e) {
      if (matrix_.rows[at(e)] < static_cast<Index>(j)) continue;
      if (matrix_.rows[at(e)] == static_cast<Index>(j)) {
        least_pivots_[j] = singular * matrix_.values[at(e)];
      }
      lower.rows.push_back(matrix_.rows[at(e)]);
      lower.values.push_back(matrix_.values[at(e)]);
    }
    lower.offsets.push_back(static_cast<Index>(lower.rows.size()));
  }
  matrix_ = std::move(lower);

  Index most_below = 0;
  for (Index s = 0; s < plan_.supernodes(); ++s) {
    most_below = std::max(most_below, plan_.row_offsets[at(s) + 1] - plan_.row_offsets[at(s)]);
  }
  const auto supernodes = at(plan_.supernodes());
  mask_.reserve(n);
  added_.reserve(n);
  row_of_.resize(n);
  position_at_.reserve(n);
  order_.reserve(n);
  panel_of_.resize(n);
  panels_.reserve(supernodes);
  rows_.reserve(plan_.rows.size());
  inverse_.resize(n);
  seen_.resize(n);
  first_child_.resize(supernodes);
  sibling_.resize(supernodes);
  local_.resize(n);
  next_.resize(supernodes);
  head_.resize(supernodes);
  reached_.resize(supernodes);
  products_.resize(at(most_below) * widest_supernode);
  work_.resize(at(most_work));
}

bool MaskedFactor::factorize(std::span<const std::uint8_t> mask, std::span<const double> added) {
  const bool is_same_mask = std::ranges::equal(mask, mask_);
  if (is_same_mask && std::ranges::equal(added, added_)) return false;
  added_.assign(added.begin(), added.end());
  if (!is_same_mask) {
    mask_.clear();  // if memory is exhausted below, the factor matches no mask
    thin_out(mask);
    mask_.assign(mask.begin(), mask.end());
  }
  std::fill_n(head_.begin(), panels_.size(), none);
  for (Index p = 0; p < static_cast<Index>(panels_.size()); ++p) {
    const Panel& panel = panels_[at(p)];
    fill(panel);
    subtract_descendants(p);
    std::array<double, widest_supernode> least{};
    for (Index j = 0; j < panel.columns; ++j) {
      least[at(j)] = least_pivots_[at(position_at_[at(panel.first + j)])];
    }
    kernels_.factor(&factor_[panel.data], panel.columns + panel.n_below, panel.columns,
                    least.data(), &inverse_[at(panel.first)], work_.data());
    reached_[at(p)] = 0;
    queue(p, 0);
  }
  return true;
}

/// Determines the panels of the submatrix and their rows.
void MaskedFactor::thin_out(std::span<const std::uint8_t> mask) {
  position_at_.clear();
  order_.clear();
  for (std::size_t position = 0; position < row_of_.size(); ++position) {
    const bool is_in = mask[at(plan_.column_at[position])] != 0;
    row_of_[position] = is_in ? static_cast<Index>(position_at_.size()) : none;
    if (!is_in) continue;
    position_at_.push_back(static_cast<Index>(position));
    order_.push_back(plan_.column_at[position]);
  }
  panels_.clear();
  rows_.clear();
  std::ranges::fill(seen_, none);
  std::ranges::fill(first_child_, none);
  std::size_t size = 0;
  Index first = 0;
  for (Index s = 0; s < plan_.supernodes(); ++s) {
    const Index end_position = plan_.firsts[at(s) + 1];
    const Index begin = first;
    while (first < static_cast<Index>(position_at_.size()) &&
           position_at_[at(first)] < end_position) {
      panel_of_[at(first++)] = static_cast<Index>(panels_.size());
    }
    if (first == begin) continue;
    Panel panel = {begin, first - begin, static_cast<Index>(rows_.size()), 0, size};
    panels_.push_back(panel);
    find_rows(s);
    panel.n_below = static_cast<Index>(rows_.size()) - panel.below;
    panels_.back() = panel;
    size += at(panel.columns) * at(panel.columns + panel.n_below);
  }
  if (factor_.size() < size) factor_.resize(size);
}

/// Selects the rows of the current panel: those of its columns and of its children that the mask
/// contains.
void MaskedFactor::find_rows(Index supernode) {
  const auto s = at(supernode);
  const Panel& panel = panels_.back();
  const auto mine = static_cast<Index>(panels_.size()) - 1;
  for (Index j = panel.first; j < panel.first + panel.columns; ++j) {
    const auto position = at(position_at_[at(j)]);
    for (Index e = matrix_.offsets[position]; e < matrix_.offsets[position + 1]; ++e) {
      seen_[at(matrix_.rows[at(e)])] = mine;
    }
  }
  for (Index child = first_child_[s]; child != none; child = sibling_[at(child)]) {
    const Panel& below = panels_[at(child)];
    for (Index r = below.below; r < below.below + below.n_below; ++r) {
      seen_[at(position_at_[at(rows_[at(r)])])] = mine;
    }
  }
  for (Index r = plan_.row_offsets[s]; r < plan_.row_offsets[s + 1]; ++r) {
    const auto position = at(plan_.rows[at(r)]);
    if (seen_[position] == mine && row_of_[position] != none) rows_.push_back(row_of_[position]);
  }
  if (static_cast<Index>(rows_.size()) == panel.below) return;
  const Index position = position_at_[at(rows_[at(panel.below)])];
  const auto up = std::upper_bound(plan_.firsts.begin(), plan_.firsts.end(), position) -
                  plan_.firsts.begin() - 1;
  sibling_[at(mine)] = first_child_[static_cast<std::size_t>(up)];
  first_child_[static_cast<std::size_t>(up)] = mine;
}

/// Copies the entries of the matrix to the panel.
void MaskedFactor::fill(const Panel& panel) {
  double* data = &factor_[panel.data];
  std::fill_n(data, at(panel.columns) * at(panel.columns + panel.n_below), 0.0);
  for (Index j = 0; j < panel.columns; ++j) local_[at(panel.first + j)] = j;
  for (Index r = 0; r < panel.n_below; ++r) {
    local_[at(rows_[at(panel.below + r)])] = panel.columns + r;
  }
  for (Index j = 0; j < panel.columns; ++j) {
    const auto position = at(position_at_[at(panel.first + j)]);
    for (Index e = matrix_.offsets[position]; e < matrix_.offsets[position + 1]; ++e) {
      const Index row = row_of_[at(matrix_.rows[at(e)])];
      if (row == none) continue;
      data[at(local_[at(row)]) * at(panel.columns) + at(j)] = matrix_.values[at(e)];
    }
    if (!added_.empty()) data[at(j * panel.columns + j)] += added_[at(plan_.column_at[position])];
  }
}

/// Subtracts the contributions of all earlier panels that have rows in this one.
void MaskedFactor::subtract_descendants(Index p) {
  const Panel& panel = panels_[at(p)];
  double* data = &factor_[panel.data];
  for (Index d = head_[at(p)]; d != none;) {
    const Panel& descendant = panels_[at(d)];
    const Index following = next_[at(d)];
    const Index begin = reached_[at(d)];
    const Index* rows = &rows_[at(descendant.below + begin)];
    const Index m = descendant.n_below - begin;
    Index n = 0;
    while (n < m && rows[n] < panel.first + panel.columns) ++n;
    const Index c = descendant.columns;
    const double* a = &factor_[descendant.data + at(c + begin) * at(c)];
    kernels_.multiply(a, m, a, n, c, products_.data(), work_.data());
    const Index stride = (n + 3) / 4 * 4;
    const bool in_a_row = rows[n - 1] - rows[0] == n - 1;
    for (Index i = 0; i < m; ++i) {
      double* row = data + at(local_[at(rows[i])]) * at(panel.columns);
      const double* product = &products_[at(i * stride)];
      const Index columns = std::min(n, i + 1);
      if (in_a_row) {
        double* target = row + (rows[0] - panel.first);
        for (Index j = 0; j < columns; ++j) target[j] -= product[j];
      } else {
        for (Index j = 0; j < columns; ++j) row[rows[j] - panel.first] -= product[j];
      }
    }
    reached_[at(d)] = begin + n;
    queue(d, begin + n);
    d = following;
  }
}

/// Adds a panel to the list of the later panel that contains its row number `row` below the
/// triangle.
void MaskedFactor::queue(Index p, Index row) {
  const Panel& panel = panels_[at(p)];
  if (row == panel.n_below) return;
  const auto target = at(panel_of_[at(rows_[at(panel.below + row)])]);
  next_[at(p)] = head_[target];
  head_[target] = p;
}

void MaskedFactor::solve(std::span<Vector3<double>> values, int fields) const {
  double* numbers = &values[0].x;
  for (const Panel& panel : panels_) {
    kernels_.solve_forward(&factor_[panel.data], panel.columns + panel.n_below, panel.columns,
                           &inverse_[at(panel.first)], panel.first, rows_.data() + panel.below,
                           numbers, fields);
  }
  for (auto panel = panels_.rbegin(); panel != panels_.rend(); ++panel) {
    kernels_.solve_backward(&factor_[panel->data], panel->columns + panel->n_below, panel->columns,
                            &inverse_[at(panel->first)], panel->first, rows_.data() + panel->below,
                            numbers, fields);
  }
}

}  // namespace dynmesh
