#include "motion/motion_once.hpp"

#include <algorithm>

#include "support/geometry.hpp"

namespace dynmesh {

template <class Real>
MotionOnce<Real>::MotionOnce(const Cells& cells, Frame first_frame, Index extra_iterations)
    : cells_(cells),
      extra_iterations_(extra_iterations),
      mean_edge_(mean_edge_length(cells, first_frame)),
      motions_(cells.size()) {}

/// s_ij = 1 / |v_i - v_j|^2 is in units of the mean edge length. Eq. (4) depends only on ratios,
/// and in these units the squares of very small and very large coordinates stay within the range of
/// Real.
template <class Real>
Index MotionOnce<Real>::estimate(Frame previous, std::span<Vector3<Real>> points,
                                 std::span<const std::uint8_t> known, Generations& generations) {
  constexpr auto floor = static_cast<Real>(squared_length_floor);
  constexpr auto ceiling = static_cast<Real>(squared_length_ceiling);
  generations.classify(cells_, known);
  const auto generation = generations.of_vertices();
  for (std::size_t v = 0; v < points.size(); ++v) motions_[v] = points[v] - previous[v];
  for (const Index j : generations.satellites()) {
    Vector3<Real> sum;
    Real weights{};
    for (const Index i : cells_[j]) {
      if (generation[i] >= generation[j]) continue;  // not reached before this iteration
      const Vector3<Real> edge = previous[i] - previous[j];
      const Vector3<Real> scaled = {edge.x / mean_edge_, edge.y / mean_edge_, edge.z / mean_edge_};
      // w_i is the number of the iteration for an anchor, and 1 for a satellite.
      const auto w = static_cast<Real>(generation[i] == Generations::anchor ? generation[j] : 1);
      const Real weight = w / std::clamp(squared_norm(scaled), floor, ceiling);
      sum = sum + weight * motions_[i];
      weights += weight;
    }
    motions_[j] = (Real{1} / weights) * sum;  // eq. (4)
    points[j] = previous[j] + motions_[j];    // eq. (3)
  }
  return generations.last() + extra_iterations_;
}

template class MotionOnce<float>;
template class MotionOnce<double>;

}  // namespace dynmesh
