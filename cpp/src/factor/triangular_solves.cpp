#include <algorithm>

#include "factor/masked_factor.hpp"
#include "support/indices.hpp"

namespace dynmesh {

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
                               &inverse_[at(panel.first)], panel.first, rows_.data() + panel.below,
                               values, fields);
  const Index n_above = panel.n_below - panel.n_inside;
  if (n_above == 0) return;
  const double* rows =
      &factor_[panel.data + at(panel.columns + panel.n_inside) * at(panel.columns)];
  kernels_.dense.subtract_products(rows, n_above, panel.columns,
                                   values + static_cast<std::ptrdiff_t>(panel.first) * 4 * fields,
                                   &in_border_[at(panel.below + panel.n_inside)], sums, fields);
}

void MaskedFactor::solve_backward(const Panel& panel, double* values, int fields) const {
  kernels_.dense.solve_backward(&factor_[panel.data], panel.rows(), panel.columns,
                                &inverse_[at(panel.first)], panel.first, rows_.data() + panel.below,
                                values, fields);
}

}  // namespace dynmesh
