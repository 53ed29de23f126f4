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

void MaskedFactor::solve(std::span<Vector3> values, int fields) {
  const auto& kernels = fields == 1 ? kernels_.dense.of_one_field : kernels_.dense.of_three_fields;
  double* sums = border_sums_.empty() ? nullptr : &border_sums_[0].x;
  solve_with(kernels, factor_.data(), inverse_.data(), sums, &values[0].x, fields);
}

void MaskedFactor::round() {
  rounded_.resize(n_entries_);
  rounded_inverse_.resize(order_.size());
  rounded_sums_.resize(quad * border_sums_.size());
  const auto copy = [](const double* from, std::size_t n, float* to) {
    std::transform(from, from + n, to, [](double x) { return static_cast<float>(x); });
  };
  constexpr Index panel_weight = 8;  // of the work of a vertex
  const auto round_one = [&](std::size_t p) {
    const Panel& panel = panels_[p];
    const std::size_t columns = at(panel.columns);
    copy(&factor_[panel.data], columns * at(panel.rows()), &rounded_[panel.data]);
    copy(&inverse_[panel.first], columns, &rounded_inverse_[panel.first]);
  };
  workers_.for_each_in_chunks(panels_.size(), round_one, panel_weight);
}

void MaskedFactor::solve_rounded(std::span<float> values) {
  solve_with(kernels_.dense.of_one_rounded_field, rounded_.data(), rounded_inverse_.data(),
             rounded_sums_.data(), values.data(), 1);
}

/// Forward steps add up in `sums` what they contribute to the rows above their subtree, to which
/// others contribute at the same time. Subtrees are shared if it is worth it.
template <class Real>
void MaskedFactor::solve_with(const SolveKernels<Real>& kernels, const Real* factor,
                              const Real* inverses, Real* border_sums, Real* numbers, int fields) {
  const std::ptrdiff_t width = std::ptrdiff_t{quad} * fields;
  const auto own = [&](const Panel& panel) { return numbers + panel.first * width; };
  const auto forward = [&](const Panel& panel, Real* sums) {
    const Index n = panel.columns;
    const Real* triangle = factor + panel.data;
    const Real* inside = triangle + n * n;
    kernels.forward(triangle, n, inverses + panel.first, own(panel));
    kernels.subtract_products(inside, panel.n_inside, n, own(panel), rows_.data() + panel.below,
                              numbers);
    kernels.subtract_products(inside + panel.n_inside * n, panel.n_below - panel.n_inside, n,
                              own(panel), in_border_.data() + panel.below + panel.n_inside, sums);
  };
  const auto backward = [&](const Panel& panel) {
    kernels.backward(factor + panel.data, panel.rows(), panel.columns, inverses + panel.first,
                     own(panel), rows_.data() + panel.below, numbers);
  };
  const auto sums_of = [&](const Border& border) {
    return border_sums + std::ptrdiff_t{3 * quad} * border.first;
  };

  const bool is_worth_it =
      static_cast<double>(n_entries_) * fields >= solve_from * workers_.task_sharing().chunk;
  for_each_subtree(is_worth_it, [&](Border& border) {
    Real* sums = sums_of(border);
    std::fill_n(sums, (border.end - border.first) * width, Real{0});
    for (Index p = border.first_panel; p < border.end_panel; ++p) forward(panels_[p], sums);
  });
  for (const Border& border : borders_) {
    const Real* sums = sums_of(border);
    for (Index i = border.first; i < border.end; ++i) {
      Real* row = numbers + border_rows_[i] * width;
      for (std::ptrdiff_t c = 0; c < width; ++c) row[c] += *sums++;
    }
  }
  for (const Index p : above_) forward(panels_[p], nullptr);
  for (auto p = above_.rbegin(); p != above_.rend(); ++p) backward(panels_[*p]);
  for_each_subtree(is_worth_it, [&](Border& border) {
    for (Index p = border.end_panel; p-- > border.first_panel;) backward(panels_[p]);
  });
}

}  // namespace dynmesh
