/// Solving with a factor, also in single precision for conjugate gradients: most of the time of a
/// solve is that of loading the factor.
#include <algorithm>
#include <numeric>

#include "linear/masked_factor.hpp"

namespace dynmesh {
namespace {

constexpr Index quad = 4;

using OwnRows = std::array<double, at(quad* widest_supernode)>;

/// Replaces some quads by zeros and returns them. Beyond them, the result is undefined, since most
/// panels have few rows.
OwnRows taken(double* quads, Index n) {
  OwnRows rows;
  std::copy_n(quads, quad * n, rows.begin());
  std::fill_n(quads, quad * n, 0.0);
  return rows;
}

constexpr auto consecutive = [] {
  std::array<Index, at(widest_supernode)> numbers{};
  std::iota(numbers.begin(), numbers.end(), 0);
  return numbers;
}();

std::size_t size_in_blocks(Index n, Index columns) {
  return at((n + rows_of_block - 1) / rows_of_block * rows_of_block) * at(columns);
}

/// Rounds rows (n, columns) and stores them in blocks. Returns their end.
float* round_rows(const double* rows, Index n, Index columns, float* blocks) {
  for (Index first = 0; first < n; first += rows_of_block) {
    for (Index j = 0; j < columns; ++j) {
      for (Index i = first; i < first + rows_of_block; ++i) {
        *blocks++ = i < n ? static_cast<float>(rows[i * columns + j]) : 0.0F;
      }
    }
  }
  return blocks;
}

}  // namespace

/// Calls `forward(panel, sums)` for all panels and then `backward(panel)` in reverse. Forward steps
/// add up in `sums` what they contribute to the rows above their subtree, to which others
/// contribute at the same time. Subtrees are shared if it is worth it.
template <class Forward, class Backward>
void MaskedFactor::pass(std::span<Vector3> values, int fields, const Forward& forward,
                        const Backward& backward) {
  const std::size_t width = at(fields);
  const bool is_worth_it =
      static_cast<double>(n_entries_) * fields >= workers_.task_sharing().solve_from;
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
  pass(values, fields, forward, backward);
}

void MaskedFactor::precondition(std::span<Vector3> values, int fields) {
  if (!is_rounded_) round();
  if (fields == 1) return precondition_one(values);
  const std::size_t width = at(fields);
  field_.resize(order_.size());
  for (std::size_t f = 0; f < width; ++f) {
    for (std::size_t r = 0; r < field_.size(); ++r) field_[r] = values[width * r + f];
    precondition_one(field_);
    for (std::size_t r = 0; r < field_.size(); ++r) values[width * r + f] = field_[r];
  }
}

/// Stores of each panel the negative inverse of its triangle and the rows below it, first those in
/// its subtree.
void MaskedFactor::round() {
  std::size_t size = 0;
  for (Panel& panel : panels_) {
    panel.rounded = size;
    size += size_in_blocks(panel.columns, panel.columns) +
            size_in_blocks(panel.n_inside, panel.columns) +
            size_in_blocks(panel.n_below - panel.n_inside, panel.columns);
  }
  if (rounded_.size() < size) rounded_.resize(size);
  constexpr Index panel_weight = 8;  // of the work of a vertex
  const auto round_one = [&](std::size_t p) { round(panels_[p]); };
  workers_.for_each_in_chunks(panels_.size(), round_one, panel_weight);
  is_rounded_ = true;
}

void MaskedFactor::round(const Panel& panel) {
  const Index n = panel.columns;
  const double* triangle = &factor_[panel.data];
  std::array<double, at(widest_supernode) * at(widest_supernode)> inverse{};
  for (Index i = 0; i < n; ++i) {
    const double scale = inverse_[panel.first + i];
    double* row = &inverse[i * n];
    row[i] = -scale;
    for (Index k = 0; k < i; ++k) {
      const double factor = scale * triangle[i * n + k];
      const double* other = &inverse[k * n];
      for (Index j = 0; j <= k; ++j) row[j] -= factor * other[j];
    }
  }
  const double* inside = triangle + n * n;
  float* blocks = &rounded_[panel.rounded];
  blocks = round_rows(inverse.data(), n, n, blocks);
  blocks = round_rows(inside, panel.n_inside, n, blocks);
  round_rows(inside + panel.n_inside * n, panel.n_below - panel.n_inside, n, blocks);
}

void MaskedFactor::precondition_one(std::span<Vector3> values) {
  double* numbers = &values[0].x;
  const DenseKernels& kernels = kernels_.dense;
  const auto forward = [&](const Panel& panel, double* sums) {
    const Index n = panel.columns;
    double* own = numbers + std::ptrdiff_t{quad} * panel.first;
    const OwnRows before = taken(own, n);
    const float* inverse = &rounded_[panel.rounded];
    const float* inside = inverse + size_in_blocks(n, n);
    const float* outside = inside + size_in_blocks(panel.n_inside, n);
    kernels.subtract_blocks(inverse, n, n, before.data(), consecutive.data(), own);
    kernels.subtract_blocks(inside, panel.n_inside, n, own, rows_.data() + panel.below, numbers);
    kernels.subtract_blocks(outside, panel.n_below - panel.n_inside, n, own,
                            in_border_.data() + panel.below + panel.n_inside, sums);
  };
  const auto backward = [&](const Panel& panel) {
    const Index n = panel.columns;
    const Index* below = rows_.data() + panel.below;
    double* own = numbers + std::ptrdiff_t{quad} * panel.first;
    const float* inverse = &rounded_[panel.rounded];
    const float* inside = inverse + size_in_blocks(n, n);
    const float* outside = inside + size_in_blocks(panel.n_inside, n);
    kernels.subtract_transposed_blocks(inside, panel.n_inside, n, own, below, numbers);
    kernels.subtract_transposed_blocks(outside, panel.n_below - panel.n_inside, n, own,
                                       below + panel.n_inside, numbers);
    const OwnRows before = taken(own, n);
    kernels.subtract_transposed_blocks(inverse, n, n, own, consecutive.data(), before.data());
  };
  pass(values, 1, forward, backward);
}

}  // namespace dynmesh
