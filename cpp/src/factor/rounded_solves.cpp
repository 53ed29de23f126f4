/// Solving with the factor in single precision, for conjugate gradients: most of the time of a
/// solve is that of loading the factor.
#include <algorithm>
#include <array>
#include <numeric>

#include "factor/masked_factor.hpp"
#include "support/geometry.hpp"

namespace dynmesh {
namespace {

constexpr Index quad = 4;

/// The quads of a panel's own rows. Those that it does not have are undefined, since most panels
/// have few.
struct OwnRows {
  std::array<double, at(quad* widest_supernode)> numbers;

  static OwnRows zeros(Index n) {
    OwnRows own;
    std::fill_n(own.numbers.begin(), quad * n, 0.0);
    return own;
  }
  static OwnRows read(const double* values, Index n, Index stride) {
    OwnRows own;
    for (Index j = 0; j < n; ++j) std::copy_n(values + j * stride, quad, own.data() + quad * j);
    return own;
  }
  void write(double* values, Index n, Index stride) const {
    for (Index j = 0; j < n; ++j) std::copy_n(data() + quad * j, quad, values + j * stride);
  }
  [[nodiscard]] double* data() { return numbers.data(); }
  [[nodiscard]] const double* data() const { return numbers.data(); }
};

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

void MaskedFactor::precondition(std::span<Vector3<double>> values, int fields) {
  if (!is_rounded_) round();
  const auto stride = quad * fields;
  for (int f = 0; f < fields; ++f) {
    double* numbers = &values[f].x;
    pass(
        &values[f], at(fields), 1,
        [&](const Panel& panel, double* sums) { forward_rounded(panel, numbers, stride, sums); },
        [&](const Panel& panel) { backward_rounded(panel, numbers, stride); });
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
  workers_.for_each_short_chunk(
      static_cast<Index>(panels_.size()),
      [&](Index first, Index last) {
        for (Index p = first; p < last; ++p) round(panels_[p]);
      },
      panel_weight);
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

void MaskedFactor::forward_rounded(const Panel& panel, double* values, Index stride,
                                   double* sums) const {
  const Index n = panel.columns;
  const Index* below = rows_.data() + panel.below;
  double* rows = values + static_cast<std::ptrdiff_t>(panel.first) * stride;
  const OwnRows before = OwnRows::read(rows, n, stride);
  OwnRows own = OwnRows::zeros(n);
  const float* blocks = &rounded_[panel.rounded];
  kernels_.blocks.subtract(blocks, n, n, before.data(), consecutive.data(), own.data(), quad);
  own.write(rows, n, stride);
  blocks += size_in_blocks(n, n);
  kernels_.blocks.subtract(blocks, panel.n_inside, n, own.data(), below, values, stride);
  blocks += size_in_blocks(panel.n_inside, n);
  kernels_.blocks.subtract(blocks, panel.n_below - panel.n_inside, n, own.data(),
                           in_border_.data() + panel.below + panel.n_inside, sums, quad);
}

void MaskedFactor::backward_rounded(const Panel& panel, double* values, Index stride) const {
  const Index n = panel.columns;
  const Index* below = rows_.data() + panel.below;
  double* rows = values + static_cast<std::ptrdiff_t>(panel.first) * stride;
  OwnRows before = OwnRows::read(rows, n, stride);
  OwnRows own = OwnRows::zeros(n);
  const float* inverse = &rounded_[panel.rounded];
  const float* blocks = inverse + size_in_blocks(n, n);
  kernels_.blocks.subtract_transposed(blocks, panel.n_inside, n, before.data(), below, values,
                                      stride);
  blocks += size_in_blocks(panel.n_inside, n);
  kernels_.blocks.subtract_transposed(blocks, panel.n_below - panel.n_inside, n, before.data(),
                                      below + panel.n_inside, values, stride);
  kernels_.blocks.subtract_transposed(inverse, n, n, own.data(), consecutive.data(), before.data(),
                                      quad);
  own.write(rows, n, stride);
}

}  // namespace dynmesh
