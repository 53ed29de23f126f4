#include <algorithm>

#include "linear/masked_factor.hpp"

namespace dynmesh {

bool MaskedFactor::factorize(std::span<const std::uint8_t> mask, std::span<const double> added) {
  const bool is_same_mask = std::ranges::equal(mask, mask_);
  if (is_same_mask && std::ranges::equal(added, added_)) return false;
  added_.assign(added.begin(), added.end());
  mask_.clear();  // if anything fails below, the factor matches no mask
  if (!is_same_mask) thin_out(mask);
  for (Panel& panel : panels_) panel.head = none;
  for_each_subtree(true, [&](Border& border) {
    lend_workspace([&](Workspace& workspace) {
      border.unfinished = none;
      for (Index p = border.first_panel; p < border.end_panel; ++p) {
        factor(p, &border, workspace);
      }
      number_border(border, workspace.local);
    });
  });
  for (const Border& border : borders_) {
    for (Index d = border.unfinished; d != none;) {
      const Index following = panels_[d].next;
      queue(d, panels_[d].reached, nullptr);
      d = following;
    }
  }
  lend_workspace([&](Workspace& workspace) {
    for (const Index p : above_) factor(p, nullptr, workspace);
  });
  mask_.assign(mask.begin(), mask.end());
  return true;
}

/// Computes a panel of the factor.
void MaskedFactor::factor(Index p, Border* border, Workspace& workspace) {
  const Panel& panel = panels_[p];
  double* triangle = &factor_[panel.data];
  double* inverse = &inverse_[panel.first];
  fill(panel, workspace);
  for (Index d = panel.head; d != none;) {
    const Index following = panels_[d].next;
    queue(d, subtract(panel, panels_[d], workspace), border);
    d = following;
  }
  kernels_.dense.factor_triangle(triangle, panel.columns, workspace.least_pivots.data(), inverse,
                                 workspace.packed.data());
  kernels_.dense.factor_below(triangle + panel.columns * panel.columns, panel.n_below,
                              panel.columns, inverse, workspace.packed.data());
  queue(p, 0, border);
}

/// Copies the entries of the matrix to the panel, and numbers its rows.
void MaskedFactor::fill(const Panel& panel, Workspace& workspace) {
  std::vector<Index>& local = workspace.local;
  double* data = &factor_[panel.data];
  std::fill_n(data, at(panel.columns) * at(panel.rows()), 0.0);
  for (Index j = 0; j < panel.columns; ++j) local[panel.first + j] = j;
  for (Index r = 0; r < panel.n_below; ++r) {
    local[rows_[panel.below + r]] = panel.columns + r;
  }
  for (Index j = 0; j < panel.columns; ++j) {
    const Index position = position_at_[panel.first + j];
    workspace.least_pivots[j] = shared_->least_pivots[position];
    for (SparseMatrix::InnerIterator e(matrix_, position); e; ++e) {
      const Index row = row_of_[e.row()];
      const std::size_t entry = at(local[std::max(row, Index{0})]) * at(panel.columns) + at(j);
      double masked_out;  // written instead of branching, which the processor could not predict
      (row == none ? masked_out : data[entry]) = e.value();
    }
    if (!added_.empty()) data[j * panel.columns + j] += added_[plan_.column_at[position]];
  }
}

/// Subtracts the contributions of the unprocessed rows of an earlier panel. Returns which is the
/// first of its rows that is not a column of this one.
Index MaskedFactor::subtract(const Panel& panel, const Panel& descendant, Workspace& workspace) {
  double* data = &factor_[panel.data];
  const Index begin = descendant.reached;
  const Index* rows = &rows_[descendant.below + begin];
  const Index last = descendant.n_below - begin;
  Index n = 0;
  while (n < last && rows[n] < panel.first + panel.columns) ++n;
  const Index c = descendant.columns;
  const double* a = &factor_[descendant.data + at(c + begin) * at(c)];
  const Index stride = (n + stride_of_products - 1) / stride_of_products * stride_of_products;
  const bool in_a_row = rows[n - 1] - rows[0] == n - 1;
  for (Index first = 0; first < last; first += Workspace::rows_of_product) {
    const Index m = std::min(Workspace::rows_of_product, last - first);
    kernels_.dense.multiply(a + first * c, m, first, a, n, c, workspace.products.data(),
                            workspace.packed.data());
    for (Index i = 0; i < m; ++i) {
      double* row = data + at(workspace.local[rows[first + i]]) * at(panel.columns);
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
  return begin + n;
}

/// Adds a panel to the list of the later panel that contains its row number `row` below the
/// triangle, or to that of the `border` if that panel is above it.
void MaskedFactor::queue(Index p, Index row, Border* border) {
  Panel& panel = panels_[p];
  panel.reached = row;
  if (row == panel.n_below) return;
  const Index target = panel_of_[rows_[panel.below + row]];
  Index& head =
      border != nullptr && target >= border->end_panel ? border->unfinished : panels_[target].head;
  panel.next = head;
  head = p;
}

/// Finds the rows of all panels of a subtree in its border.
void MaskedFactor::number_border(const Border& border, std::vector<Index>& local) {
  if (border.first_panel == border.end_panel) return;
  const Panel& root = panels_[border.end_panel - 1];
  const Index end_row = root.first + root.columns;  // the first one outside the subtree
  for (Index i = border.first; i < border.end; ++i) {
    local[border_rows_[i]] = i - border.first;
  }
  for (Index p = border.first_panel; p < border.end_panel; ++p) {
    Panel& panel = panels_[p];
    const auto begin = rows_.begin() + panel.below;
    const auto end = begin + panel.n_below;
    panel.n_inside = static_cast<Index>(std::lower_bound(begin, end, end_row) - begin);
    for (Index r = panel.below + panel.n_inside; r < panel.below + panel.n_below; ++r) {
      in_border_[r] = local[rows_[r]];
    }
  }
}

}  // namespace dynmesh
