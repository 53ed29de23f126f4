#include <algorithm>
#include <array>

#include "factor/masked_factor.hpp"
#include "support/indices.hpp"

namespace dynmesh {
namespace {

/// The least number of rows of a panel that a thread takes at once, if several compute it together:
/// a multiple of those that the kernels take, so that the results are those of one thread.
constexpr Index rows_of_piece = 32;

}  // namespace

bool MaskedFactor::factorize(std::span<const std::uint8_t> mask, std::span<const double> added) {
  const bool is_same_mask = std::ranges::equal(mask, mask_);
  if (is_same_mask && std::ranges::equal(added, added_)) return false;
  added_.assign(added.begin(), added.end());
  is_rounded_ = false;
  if (!is_same_mask) {
    mask_.clear();  // if memory is exhausted below, the factor matches no mask
    thin_out(mask);
    mask_.assign(mask.begin(), mask.end());
  }
  std::fill_n(head_.begin(), panels_.size(), none);
  for_each_subtree(true, [&](Border& border) {
    workspaces_.lend([&](Workspace& workspace) {
      border.unfinished = none;
      for (Index p = border.first_panel; p < border.end_panel; ++p) {
        factor_alone(p, &border, workspace);
      }
      number_border(border, workspace.local);
    });
  });
  for (const Border& border : borders_) {
    for (Index d = border.unfinished; d != none;) {
      const Index following = next_[d];
      queue(d, reached_[d], nullptr);
      d = following;
    }
  }
  workspaces_.lend([&](Workspace& workspace) {
    const double worth_it = workers_.task_sharing().factor_step_from;
    for (const Index p : above_) {
      const bool has_parts =
          workers_.threads() > 1 && !borders_.empty() && panels_[p].rows() > rows_of_piece;
      if (has_parts && multiplications_before(p) >= worth_it) {
        factor_together(p, workspace);
      } else {
        factor_alone(p, nullptr, workspace);
      }
    }
  });
  return true;
}

/// Computes a panel of the factor, in one thread.
void MaskedFactor::factor_alone(Index p, Border* border, Workspace& workspace) {
  const Panel& panel = panels_[p];
  fill(panel, workspace.local);
  for (Index d = head_[p]; d != none;) {
    const Index following = next_[d];
    const Index n = n_common(d, panel);
    subtract_rows(panel, d, n, 0, panels_[d].n_below - reached_[d], workspace.local, workspace);
    queue(d, reached_[d] + n, border);
    d = following;
  }
  factor_triangle(panel, workspace);
  kernels_.dense.factor_below(&factor_[panel.data] + panel.columns * panel.columns, panel.n_below,
                              panel.columns, &inverse_[panel.first], workspace.packed.data());
  queue(p, 0, border);
}

/// The number of multiplications for the contributions of all earlier panels.
double MaskedFactor::multiplications_before(Index p) const {
  double sum = 0;
  for (Index d = head_[p]; d != none; d = next_[d]) {
    sum += static_cast<double>(panels_[d].n_below - reached_[d]) * n_common(d, panels_[p]) *
           panels_[d].columns;
  }
  return sum;
}

/// Computes a panel of the factor above all subtrees, in several threads: each of them a few rows
/// at a time, in which it subtracts the contributions of all earlier panels.
void MaskedFactor::factor_together(Index p, Workspace& workspace) {
  const Panel& panel = panels_[p];
  fill(panel, workspace.local);
  const auto in_pieces = [&](Index n_rows, bool is_worth_it, const auto& work) {
    const Index n_pieces = (n_rows + rows_of_piece - 1) / rows_of_piece;
    const Index rows = rows_of_piece * std::max(n_pieces / (2 * workers_.threads()), Index{1});
    workers_.share((n_rows + rows - 1) / rows, is_worth_it,
                   [&](Index i) { work(i * rows, std::min(n_rows, (i + 1) * rows)); });
  };
  in_pieces(panel.rows(), true, [&](Index begin, Index end) {
    workspaces_.lend([&](Workspace& own) {
      for (Index d = head_[p]; d != none; d = next_[d]) {
        const Index* rows = &rows_[panels_[d].below + reached_[d]];
        const Index m = panels_[d].n_below - reached_[d];
        const auto is_before = [&](Index row, Index limit) { return workspace.local[row] < limit; };
        const auto first = std::lower_bound(rows, rows + m, begin, is_before) - rows;
        const auto last = std::lower_bound(rows + first, rows + m, end, is_before) - rows;
        subtract_rows(panel, d, n_common(d, panel), static_cast<Index>(first),
                      static_cast<Index>(last), workspace.local, own);
      }
    });
  });
  for (Index d = head_[p]; d != none;) {
    const Index following = next_[d];
    queue(d, reached_[d] + n_common(d, panel), nullptr);
    d = following;
  }
  factor_triangle(panel, workspace);
  double* below = &factor_[panel.data] + panel.columns * panel.columns;
  const double products = 0.5 * panel.n_below * panel.columns * panel.columns;
  in_pieces(panel.n_below, products >= workers_.task_sharing().factor_step_from,
            [&](Index begin, Index end) {
              kernels_.dense.factor_below(below + begin * panel.columns, end - begin, panel.columns,
                                          &inverse_[panel.first], workspace.packed.data());
            });
  queue(p, 0, nullptr);
}

/// Copies the entries of the matrix to the panel, and numbers its rows.
void MaskedFactor::fill(const Panel& panel, std::vector<Index>& local) {
  double* data = &factor_[panel.data];
  std::fill_n(data, at(panel.columns) * at(panel.rows()), 0.0);
  for (Index j = 0; j < panel.columns; ++j) local[panel.first + j] = j;
  for (Index r = 0; r < panel.n_below; ++r) {
    local[rows_[panel.below + r]] = panel.columns + r;
  }
  for (Index j = 0; j < panel.columns; ++j) {
    const Index position = position_at_[panel.first + j];
    for (SparseMatrix::InnerIterator e(matrix_, position); e; ++e) {
      const Index row = row_of_[e.row()];
      const std::size_t entry = at(local[std::max(row, Index{0})]) * at(panel.columns) + at(j);
      double masked_out;  // written instead of branching, which the processor could not predict
      (row == none ? masked_out : data[entry]) = e.value();
    }
    if (!added_.empty()) data[j * panel.columns + j] += added_[plan_.column_at[position]];
  }
}

/// The number of unprocessed rows of an earlier panel that are columns of this one.
Index MaskedFactor::n_common(Index d, const Panel& panel) const {
  const Panel& descendant = panels_[d];
  const Index* rows = &rows_[descendant.below + reached_[d]];
  const Index m = descendant.n_below - reached_[d];
  Index n = 0;
  while (n < m && rows[n] < panel.first + panel.columns) ++n;
  return n;
}

/// Subtracts the contributions of the unprocessed rows `first` to `last` - 1 of an earlier panel,
/// of which the first `n` are columns of this one.
void MaskedFactor::subtract_rows(const Panel& panel, Index d, Index n, Index first, Index last,
                                 const std::vector<Index>& local, Workspace& workspace) {
  double* data = &factor_[panel.data];
  const Panel& descendant = panels_[d];
  const Index begin = reached_[d];
  const Index* rows = &rows_[descendant.below + begin];
  const Index c = descendant.columns;
  const double* a = &factor_[descendant.data + at(c + begin) * at(c)];
  const Index stride = (n + stride_of_products - 1) / stride_of_products * stride_of_products;
  const bool in_a_row = rows[n - 1] - rows[0] == n - 1;
  for (; first < last; first += rows_of_product) {
    const Index m = std::min(rows_of_product, last - first);
    kernels_.dense.multiply(a + first * c, m, first, a, n, c, workspace.products.data(),
                            workspace.packed.data());
    for (Index i = 0; i < m; ++i) {
      double* row = data + at(local[rows[first + i]]) * at(panel.columns);
      const double* product = &workspace.products[i * stride];
      const Index columns = std::min(n, first + i + 1);
      if (in_a_row) {
        double* target = row + (rows[0] - panel.first);
        for (Index j = 0; j < columns; ++j) target[j] -= product[j];
      } else {
        for (Index j = 0; j < columns; ++j) row[rows[j] - panel.first] -= product[j];
      }
    }
  }
}

void MaskedFactor::factor_triangle(const Panel& panel, Workspace& workspace) {
  std::array<double, widest_supernode> least{};
  for (Index j = 0; j < panel.columns; ++j) {
    least[j] = least_pivots_[position_at_[panel.first + j]];
  }
  kernels_.dense.factor_triangle(&factor_[panel.data], panel.columns, least.data(),
                                 &inverse_[panel.first], workspace.packed.data());
}

/// Adds a panel to the list of the later panel that contains its row number `row` below the
/// triangle, or to that of the `border` if that panel is above it.
void MaskedFactor::queue(Index p, Index row, Border* border) {
  const Panel& panel = panels_[p];
  reached_[p] = row;
  if (row == panel.n_below) return;
  const Index target = panel_of_[rows_[panel.below + row]];
  Index& head =
      border != nullptr && target >= border->end_panel ? border->unfinished : head_[target];
  next_[p] = head;
  head = p;
}

/// Finds the rows of all panels of a subtree in its border.
void MaskedFactor::number_border(const Border& border, std::vector<Index>& local) {
  for (Index i = border.first; i < border.end; ++i) {
    local[border_rows_[i]] = i - border.first;
  }
  for (Index p = border.first_panel; p < border.end_panel; ++p) {
    Panel& panel = panels_[p];
    const auto begin = rows_.begin() + panel.below;
    const auto end = begin + panel.n_below;
    panel.n_inside = static_cast<Index>(std::lower_bound(begin, end, border.end_row) - begin);
    for (Index r = panel.below + panel.n_inside; r < panel.below + panel.n_below; ++r) {
      in_border_[r] = local[rows_[r]];
    }
  }
}

}  // namespace dynmesh
