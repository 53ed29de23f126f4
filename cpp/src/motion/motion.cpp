#include "motion/motion.hpp"

#include <algorithm>
#include <limits>
#include <utility>

#include "support/checks.hpp"
#include "support/geometry.hpp"

namespace dynmesh {
template <class Real>
Motion<Real>::Motion(const Cells& cells, Frame first_frame, Index extra_iterations,
                     Workers& workers, const Sweeps<Real>& sweeps)
    : workers_(workers),
      sweeps_(sweeps),
      extra_iterations_(extra_iterations),
      neighbours_(slots * cells.size()),
      valence_(cells.size()),
      weights_(2 * cells.size()),
      before_(cells.size()),
      after_(cells.size()),
      visits_(cells.size()),
      rows_(cells.size()) {
  constexpr std::size_t most = std::numeric_limits<std::uint32_t>::max() / sizeof(Vector3<Real>);
  if (cells.size() > most) {
    refuse("first_frame", "has ", cells.size(), " vertices, but method motion supports at most ",
           most);
  }
  for (std::size_t j = 0; j < cells.size(); ++j) {
    const auto cell = cells[j];
    valence_[j] = static_cast<std::uint8_t>(std::min<std::size_t>(cell.size(), slots + 1));
    // Empty slots refer to the vertex itself and have weight 0.
    const auto neighbour = [&](std::size_t slot) {
      const std::size_t i = slot < cell.size() ? static_cast<std::size_t>(cell[slot]) : j;
      return static_cast<std::uint32_t>(i * sizeof(Vector3<Real>));
    };
    std::uint32_t* of_vertex = &neighbours_[slots * j];
    if (cell.size() <= slots) {
      for (std::size_t slot = 0; slot < slots; ++slot) of_vertex[slot] = neighbour(slot);
      continue;
    }
    wide_.push_back(static_cast<Index>(j));
    of_vertex[0] = static_cast<std::uint32_t>(wide_neighbours_.size());
    of_vertex[2] = static_cast<std::uint32_t>(wide_neighbours_.size() + cell.size());
    for (std::size_t slot = 0; slot < (cell.size() + 3) / 4 * 4; ++slot) {
      wide_neighbours_.push_back(neighbour(slot));
    }
    of_vertex[1] = static_cast<std::uint32_t>(wide_neighbours_.size());
  }
  wide_weights_.resize(wide_neighbours_.size() / 4);
  data_.neighbours = neighbours_.data();
  data_.valence = valence_.data();
  data_.wide = wide_.data();
  data_.wide_neighbours = wide_neighbours_.data();
  data_.inverse_mean_edge =
      std::min(Real{1} / mean_edge_length(cells, first_frame), std::numeric_limits<Real>::max());
  data_.weights = &weights_[0].x;
  data_.wide_weights = reinterpret_cast<Real*>(wide_weights_.data());
  data_.before = &before_[0].x;
  data_.after = &after_[0].x;
  data_.visits = visits_.data();
  data_.rows = rows_.data();
  const auto k = static_cast<Index>(cells.size());
  const auto wide_before = [&](Index v) {
    return static_cast<Index>(std::ranges::lower_bound(wide_, v) - wide_.begin());
  };
  const Index chunk = workers.task_sharing().chunk;
  for (Index first = 0; first < k; first += chunk) {
    const Index last = std::min(first + chunk, k);
    chunks_.push_back({first, last, wide_before(first), wide_before(last), 0, 0, 0, 0});
  }
}

/// Executes one iteration and returns the number of satellites reached so far.
template <class Real>
Index Motion<Real>::sweep(Index t) {
  workers_.for_each(n_chunks(),
                    [&](Index c) { chunks_[c].reached = sweeps_.sweep(data_, chunks_[c], t); });
  Index reached = 0;
  for (const Rows& rows : chunks_) reached += rows.reached;
  return reached;
}

template <class Real>
Index Motion<Real>::estimate(Frame previous, std::span<Vector3<Real>> points,
                             std::span<const std::uint8_t> known, Generations& generations) {
  data_.known = known.data();
  data_.previous = &previous[0].x;
  data_.points = &points[0].x;
  data_.generation = generations.to_fill().data();
  workers_.for_each(n_chunks(), [&](Index c) { chunks_[c] = sweeps_.prepare(data_, chunks_[c]); });
  Index unknown = 0;
  for (const Rows& rows : chunks_) unknown += rows.usual + rows.narrow + rows.wide;

  Index reached = 0;
  Index last = 0;  // T
  Index t = 0;
  while (reached < unknown) {
    const Index now = sweep(++t);
    if (now == reached)
      break;  // the other vertices are disconnected, and this iteration does not count
    reached = now;
    last = t;
    std::swap(data_.before, data_.after);
  }
  Index sweeps_made = t;
  for (t = last + 1; t <= last + extra_iterations_; ++t) {
    if (t > sweeps_made) {
      sweep(t);
      sweeps_made = t;
    }
    std::swap(data_.before, data_.after);
  }
  workers_.for_each(n_chunks(), [&](Index c) { sweeps_.finish(data_, chunks_[c], sweeps_made); });
  generations.set_counts(previous.size() - static_cast<std::size_t>(unknown),
                         static_cast<std::size_t>(reached));
  return last + extra_iterations_;
}

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

template class Motion<float>;
template class Motion<double>;
template class MotionOnce<float>;
template class MotionOnce<double>;

}  // namespace dynmesh
