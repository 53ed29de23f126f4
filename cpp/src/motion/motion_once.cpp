#include "motion/motion.hpp"

#include <algorithm>
#include <utility>

#include "support/geometry.hpp"

namespace dynmesh {

template <class Real>
Motion<Real>::Motion(const Cells& cells, Frame first_frame, bool revisit, Index extra_iterations)
    : cells_(cells),
      revisit_(revisit),
      extra_iterations_(extra_iterations),
      mean_edge_(mean_edge_length(cells, first_frame)),
      anchor_sums_(cells.size()),
      row_ends_(cells.size() + 1),
      neighbours_(cells.neighbours.size()),
      estimates_(cells.size()),
      next_(cells.size()),
      row_of_(cells.size()) {}

/// s_ij = 1 / |v_i - v_j|^2, in units of the mean edge length. Eq. (4) depends only on ratios, and
/// in these units the squares of very small and very large coordinates stay within the range of
/// Real.
template <class Real>
Real Motion<Real>::inverse_squared_distance(const Vector3<Real>& a, const Vector3<Real>& b) const {
  constexpr auto floor = static_cast<Real>(squared_length_floor);
  constexpr auto ceiling = static_cast<Real>(squared_length_ceiling);
  const Vector3<Real> edge = a - b;
  const Vector3<Real> scaled = {edge.x / mean_edge_, edge.y / mean_edge_, edge.z / mean_edge_};
  return Real{1} / std::clamp(squared_norm(scaled), floor, ceiling);
}

/// Splits the sums of eq. (4) into two parts: the sum over the anchors of a cell, which is the same
/// in all iterations, and the sum over its satellites, which is not.
template <class Real>
void Motion<Real>::gather(Frame previous, std::span<const Vector3<Real>> points,
                          const Generations& generations) {
  const auto satellites = generations.satellites();
  const auto generation = generations.of_vertices();
  for (std::size_t row = 0; row < satellites.size(); ++row) {
    row_of_[satellites[row]] = static_cast<std::uint32_t>(row);
  }

  std::size_t end = 0;
  for (std::size_t row = 0; row < satellites.size(); ++row) {
    const Vector3<Real>& v_j = previous[satellites[row]];
    Weighted anchor_sum{};
    for (const Index i : cells_[satellites[row]]) {
      const Real s = inverse_squared_distance(previous[i], v_j);
      if (generation[i] == Generations::anchor) {
        anchor_sum.add(s, {points[i] - previous[i], Real{1}});
      } else {
        neighbours_[end++] = {row_of_[i], s};
      }
    }
    anchor_sums_[row] = anchor_sum;
    row_ends_[row + 1] = static_cast<Index>(end);
  }
}

/// Numerator and denominator of eq. (4). The weight w_i of an anchor is the number of the
/// iteration. The weight of a satellite is part of its estimate, and is zero until the satellite is
/// reached.
template <class Real>
typename Motion<Real>::Weighted Motion<Real>::weighted_sum(std::size_t row, Index iteration) const {
  Weighted sum{};
  sum.add(static_cast<Real>(iteration), anchor_sums_[row]);
  for (auto i = row_ends_[row]; i < row_ends_[row + 1]; ++i) {
    const Neighbour& neighbour = neighbours_[i];
    sum.add(neighbour.s, estimates_[neighbour.row]);
  }
  return sum;
}

template <class Real>
Index Motion<Real>::estimate(Frame previous, std::span<Vector3<Real>> points,
                             std::span<const std::uint8_t> known, Generations& generations) {
  generations.classify(cells_, known);
  gather(previous, points, generations);

  const auto satellites = generations.satellites();
  const auto generation = generations.of_vertices();
  std::fill_n(estimates_.begin(), satellites.size(), Weighted{});
  std::fill_n(next_.begin(), satellites.size(), Weighted{});

  const Index iterations = generations.last() + extra_iterations_;
  for (Index t = 1; t <= iterations; ++t) {
    const std::size_t first = revisit_ ? 0 : generations.reached_by(t - 1);
    const std::size_t last = generations.reached_by(t);
    for (std::size_t row = first; row < last; ++row) {
      const auto j = static_cast<std::size_t>(satellites[row]);
      const Weighted sum = weighted_sum(row, t);
      const Vector3<Real> d_j = (Real{1} / sum.weight) * sum.motion;  // eq. (4)
      const auto w_j =
          static_cast<Real>(t + 1 - generation[j]);  // 1 at first, then one more in each iteration
      next_[row] = {w_j * d_j, w_j};
    }
    // Every estimate is computed from those of the previous iteration.
    if (revisit_) {
      std::swap(estimates_, next_);
    } else {
      std::copy(next_.begin() + static_cast<std::ptrdiff_t>(first),
                next_.begin() + static_cast<std::ptrdiff_t>(last),
                estimates_.begin() + static_cast<std::ptrdiff_t>(first));
    }
  }

  for (std::size_t row = 0; row < satellites.size(); ++row) {
    const auto j = static_cast<std::size_t>(satellites[row]);
    const Weighted& estimate = estimates_[row];
    points[j] = previous[j] + (Real{1} / estimate.weight) * estimate.motion;  // eq. (3)
  }
  return iterations;
}

template class Motion<float>;
template class Motion<double>;

}  // namespace dynmesh
