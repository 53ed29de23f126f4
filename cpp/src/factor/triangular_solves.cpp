#include <algorithm>

#include "factor/masked_factor.hpp"
#include "support/indices.hpp"

namespace dynmesh {

void MaskedFactor::solve(std::span<Vector3<double>> values, int fields) {
  double* numbers = &values[0].x;
  const auto width = static_cast<std::size_t>(fields);
  const bool is_worth_it = cost_.entries * fields >= workers_.task_sharing().solve_from;
  for_each_subtree(is_worth_it, [&](Border& border) { solve_forward(border, numbers, fields); });
  for (const Border& border : borders_) {
    const Vector3<double>* sums = border_sums_.data() + 3 * border.first;
    for (Index i = border.first; i < border.end; ++i) {
      Vector3<double>* row = &values[at(border_rows_[at(i)]) * width];
      for (std::size_t f = 0; f < width; ++f) row[f] = row[f] + *sums++;
    }
  }
  for (const Index p : above_) {
    solve_forward(panels_[at(p)], panels_[at(p)].n_below, numbers, fields);
  }
  for (auto p = above_.rbegin(); p != above_.rend(); ++p) {
    solve_backward(panels_[at(*p)], numbers, fields);
  }
  for_each_subtree(is_worth_it, [&](Border& border) {
    for (Index p = border.end_panel; p-- > border.first_panel;) {
      solve_backward(panels_[at(p)], numbers, fields);
    }
  });
}

/// Solves for the rows of a subtree, and adds up what it contributes to the rows above it, to which
/// others contribute at the same time.
void MaskedFactor::solve_forward(const Border& border, double* values, int fields) {
  Vector3<double>* sums = border_sums_.data() + 3 * border.first;
  std::fill_n(sums, (border.end - border.first) * fields, Vector3<double>{});
  for (Index p = border.first_panel; p < border.end_panel; ++p) {
    const Panel& panel = panels_[at(p)];
    solve_forward(panel, panel.n_inside, values, fields);
    const Index n_above = panel.n_below - panel.n_inside;
    if (n_above == 0) continue;
    const double* rows =
        &factor_[panel.data + at(panel.columns + panel.n_inside) * at(panel.columns)];
    kernels_.subtract_products(rows, n_above, panel.columns,
                               values + static_cast<std::ptrdiff_t>(panel.first) * 4 * fields,
                               &in_border_[at(panel.below + panel.n_inside)], &sums->x, fields);
  }
}

void MaskedFactor::solve_forward(const Panel& panel, Index n_below, double* values,
                                 int fields) const {
  kernels_.solve_forward(&factor_[panel.data], panel.columns + n_below, panel.columns,
                         &inverse_[at(panel.first)], panel.first, rows_.data() + panel.below,
                         values, fields);
}

void MaskedFactor::solve_backward(const Panel& panel, double* values, int fields) const {
  kernels_.solve_backward(&factor_[panel.data], panel.rows(), panel.columns,
                          &inverse_[at(panel.first)], panel.first, rows_.data() + panel.below,
                          values, fields);
}

}  // namespace dynmesh
