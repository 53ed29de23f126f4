/// Solving with a factor: most of the time is that of loading it.
#include <algorithm>

#include "linear/masked_factor.hpp"

namespace dynmesh {
namespace {

constexpr Index quad = 4;

/// Solving with a factor that is divided is shared if it takes this many multiplications for each
/// vertex of a chunk.
constexpr double solve_from = 2e5 / 1024;

}  // namespace

/// Forward steps add up in `sums` what they contribute to the rows above their subtree, to which
/// others contribute at the same time. Subtrees are shared if it is worth it.
void MaskedFactor::solve(std::span<Vector3> values, int fields) {
  const SolveKernels& kernels =
      fields == 1 ? kernels_.dense.of_one_field : kernels_.dense.of_three_fields;
  double* numbers = &values[0].x;
  const auto own = [&](const Panel& panel) {
    return numbers + std::ptrdiff_t{quad} * panel.first * fields;
  };
  const auto forward = [&](const Panel& panel, double* sums) {
    const Index n = panel.columns;
    const double* triangle = &factor_[panel.data];
    const double* inside = triangle + n * n;
    kernels.forward(triangle, n, &inverse_[panel.first], own(panel));
    kernels.subtract_products(inside, panel.n_inside, n, own(panel), rows_.data() + panel.below,
                              numbers);
    kernels.subtract_products(inside + panel.n_inside * n, panel.n_below - panel.n_inside, n,
                              own(panel), in_border_.data() + panel.below + panel.n_inside, sums);
  };
  const auto backward = [&](const Panel& panel) {
    kernels.backward(&factor_[panel.data], panel.rows(), panel.columns, &inverse_[panel.first],
                     own(panel), rows_.data() + panel.below, numbers);
  };

  const std::size_t width = at(fields);
  const bool is_worth_it =
      static_cast<double>(n_entries_) * fields >= solve_from * workers_.task_sharing().chunk;
  for_each_subtree(is_worth_it, [&](Border& border) {
    Vector3* sums = border_sums_.data() + 3 * border.first;
    std::fill_n(sums, at(border.end - border.first) * width, Vector3{});
    for (Index p = border.first_panel; p < border.end_panel; ++p) forward(panels_[p], &sums->x);
  });
  for (const Border& border : borders_) {
    const Vector3* sums = border_sums_.data() + 3 * border.first;
    for (Index i = border.first; i < border.end; ++i) {
      Vector3* row = &values[at(border_rows_[i]) * width];
      for (std::size_t f = 0; f < width; ++f) row[f] = row[f] + *sums++;
    }
  }
  for (const Index p : above_) forward(panels_[p], nullptr);
  for (auto p = above_.rbegin(); p != above_.rend(); ++p) backward(panels_[*p]);
  for_each_subtree(is_worth_it, [&](Border& border) {
    for (Index p = border.end_panel; p-- > border.first_panel;) backward(panels_[p]);
  });
}

}  // namespace dynmesh
