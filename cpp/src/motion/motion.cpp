#include "motion/motion.hpp"

#include <algorithm>
#include <limits>
#include <numeric>
#include <utility>

#include "base/geometry.hpp"

namespace dynmesh {

template <class Real>
Motion<Real>::Motion(const Cells& cells, Field first_frame, Index extra_iterations, bool revisits,
                     Workers& workers)
    : cells_(cells),
      workers_(workers),
      extra_iterations_(extra_iterations),
      revisits_(revisits),
      per_mean_edge_(
          std::min(1 / mean_edge_length(cells, first_frame), std::numeric_limits<double>::max())),
      order_(cells.size()),
      satellites_(cells.size() + 1),  // loops without branches write one number too many
      unknown_(cells.size() + 1),
      s_(cells.neighbours.size()),
      d_(cells.size()),
      means_(cells.size()) {
  std::iota(order_.begin(), order_.end(), Index{0});
  const auto k = static_cast<Index>(cells.size());
  const Index length = workers.task_sharing().chunk;
  for (Index v = 0; v < k; v += length) chunks_.push_back({v, std::min(v + length, k)});
  // Near vertices by the sizes of their cells, since a processor foresees the end of a loop that
  // has always been as long.
  constexpr Index near = 64;
  for (const Chunk& chunk : chunks_) {
    for (Index v = chunk.first; v < chunk.last; v += near) {
      std::stable_sort(order_.begin() + v, order_.begin() + std::min(v + near, chunk.last),
                       [&](Index a, Index b) { return cells[a].size() < cells[b].size(); });
    }
  }
}

template <class Real>
std::size_t Motion<Real>::estimate(Field previous, std::span<Vector3> points,
                                   std::span<const std::uint8_t> known, Generations& generations) {
  const std::span<Index> generation = generations.to_fill();
  const auto in_chunks = [&](const auto& work) {
    workers_.for_each(static_cast<Index>(chunks_.size()), [&](Index c) { work(chunks_[c]); });
    Index unknown = 0;
    for (const Chunk& chunk : chunks_) unknown += chunk.unknown;
    return unknown;
  };
  const auto iterate = [&](Index t) {
    return in_chunks([&](Chunk& chunk) {
      search(chunk, t, generation);
      weigh(chunk, previous);
      find_means(chunk, t, generation);
    });
  };

  const Index missing =
      in_chunks([&](Chunk& chunk) { classify(chunk, previous, points, known, generation); });
  Index unknown = missing;
  Index t = 0;  // at last T
  while (unknown > 0) {
    const Index still_unknown = iterate(t + 1);
    if (still_unknown == unknown) break;  // disconnected, and this iteration does not count
    unknown = still_unknown;
    ++t;
    std::swap(d_, means_);
  }
  for (Index extra = 1; extra <= (revisits_ ? extra_iterations_ : 0); ++extra) {
    iterate(t + extra);
    std::swap(d_, means_);
  }
  in_chunks([&](Chunk& chunk) {
    for (const Index j : std::span(&satellites_[chunk.first], at(chunk.reached))) {
      const Weighted d = d_[j] / d_[j][3];
      points[j] = previous[j] + Vector3{d[0], d[1], d[2]};  // eq. (3)
      if (!is_in_range(points[j], largest_coordinate<Real>)) points[j] = previous[j];
    }
  });
  generations.set_counts(known.size() - at(missing), at(missing - unknown));
  return at(t + extra_iterations_);
}

/// Finds the motions of the anchors, and lists the other vertices. The loops have no branches,
/// since masks may be random.
template <class Real>
void Motion<Real>::classify(Chunk& chunk, Field previous, Field points,
                            std::span<const std::uint8_t> known, std::span<Index> generation) {
  Weighted* const d = d_.data();
  for (Index v = chunk.first; v < chunk.last; ++v) {
    const auto moved = points[v] - previous[v];
    d[v] = {static_cast<Real>(moved.x), static_cast<Real>(moved.y), static_cast<Real>(moved.z),
            Real{1}};
  }
  static_assert(Generations::anchor == 0 && Generations::disconnected == -1);
  for (Index v = chunk.first; v < chunk.last; ++v) generation[v] = Index{known[v]} - 1;
  Index* const unknown = &unknown_[chunk.first];
  Index n = 0;
  for (const Index v : std::span(&order_[chunk.first], at(chunk.last - chunk.first))) {
    unknown[n] = v;
    n -= generation[v];
  }
  for (Index r = 0; r < n; ++r) d[unknown[r]] = Weighted::Zero();
  std::copy(d + chunk.first, d + chunk.last, &means_[chunk.first]);
  chunk = {chunk.first, chunk.last, 0, 0, n, 0};
}

/// Finds the satellites of generation t: the cell of each has a known motion.
template <class Real>
void Motion<Real>::search(Chunk& chunk, Index t, std::span<Index> generation) {
  Index* const satellites = &satellites_[chunk.first];
  Index* const unknown = &unknown_[chunk.first];
  chunk.before = chunk.reached;
  Index left = 0;
  for (Index r = 0; r < chunk.unknown; ++r) {
    const Index j = unknown[r];
    Real weights = 0;
    for (const Index i : cells_[j]) weights += d_[i][3];
    const Index is_reached{weights > 0};
    generation[j] = (-is_reached & (t + 1)) - 1;  // t, or as before
    satellites[chunk.reached] = j;
    chunk.reached += is_reached;
    unknown[left] = j;
    left += 1 - is_reached;
  }
  chunk.unknown = left;
}

/// Finds s_ij = 1 / |v_i - v_j|^2 of these satellites. Lengths are in mean edges: eq. (4) depends
/// only on ratios, and in this unit squares stay in range.
template <class Real>
void Motion<Real>::weigh(Chunk& chunk, Field previous) {
  using Position = Eigen::Map<const Eigen::Array4d, Eigen::Aligned16>;  // two instructions less
  Real* const s = s_.data() + cells_.offsets[chunk.first];  // at the end, without neighbours
  Index n = chunk.weighed;
  for (Index r = chunk.before; r < chunk.reached; ++r) {
    const Index j = satellites_[chunk.first + r];
    const Eigen::Array4d here = Position(&previous[j].x);
    for (const Index i : cells_[j]) {
      const Eigen::Array4d edge = per_mean_edge_ * (Position(&previous[i].x) - here);
      const Eigen::Array4d squares = edge.square();
      const double square = squares[0] + squares[1] + squares[2];
      s[n++] = static_cast<Real>(std::min(square, squared_length_ceiling));
    }
  }
  Eigen::Map<Eigen::Array<Real, Eigen::Dynamic, 1>> weights(s + chunk.weighed, n - chunk.weighed);
  weights = weights.max(static_cast<Real>(squared_length_floor)).inverse();
  chunk.weighed = n;
}

/// Finds the means (4) of all satellites so far, or of those of generation t.
template <class Real>
void Motion<Real>::find_means(const Chunk& chunk, Index t, std::span<const Index> generation) {
  const auto next = static_cast<Real>(t + 1);
  const Weighted* const d = d_.data();
  Weighted* const means = means_.data();
  const Real* s = s_.data() + cells_.offsets[chunk.first];
  const auto satellites = std::span(&satellites_[chunk.first], at(chunk.reached));
  const std::size_t first = revisits_ ? 0 : at(chunk.before);
  for (const Index j : satellites.first(first)) {
    means[j] = d[j];
    s += cells_[j].size();
  }
  for (const Index j : satellites.subspan(first)) {
    Weighted sum = Weighted::Zero();
    for (const Index i : cells_[j]) sum += *s++ * d[i];  // eq. (4)
    // With the weight w = t + 1 - g of the next iteration, divided by t + 1.
    means[j] = (next - static_cast<Real>(generation[j])) / (next * sum[3]) * sum;
  }
}

template class Motion<float>;
template class Motion<double>;

}  // namespace dynmesh
