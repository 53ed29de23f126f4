#include "motion/motion.hpp"

#include <algorithm>
#include <limits>
#include <numeric>
#include <utility>

#include "base/geometry.hpp"

namespace dynmesh {

Motion::Motion(const Cells& cells, Field first_frame, Index extra_iterations, bool revisit,
               Workers& workers, const MotionKernels& kernels)
    : cells_(cells),
      workers_(workers),
      kernels_(kernels),
      extra_iterations_(extra_iterations),
      revisits_(revisit),
      per_mean_edge_(
          std::min(1 / mean_edge_length(cells, first_frame), std::numeric_limits<double>::max())),
      order_(cells.size()),
      rows_(cells.size()),
      weights_(cells.neighbours.size()),
      moved_(cells.size()),
      means_(cells.size()) {
  std::iota(order_.begin(), order_.end(), Index{0});
  const auto k = static_cast<Index>(cells.size());
  const Index length = workers.task_sharing().chunk;
  for (Index first = 0; first < k; first += length) {
    const Index last = std::min(first + length, k);
    chunks_.push_back({first, last});
    std::stable_sort(order_.begin() + first, order_.begin() + last,
                     [&](Index a, Index b) { return cells[a].size() < cells[b].size(); });
  }
}

std::size_t Motion::estimate(Field previous, std::span<Vector3> points,
                             std::span<const std::uint8_t> known, Generations& generations) {
  const std::span<Index> generation = generations.to_fill();
  for_each_chunk([&](Chunk& chunk) { begin(chunk, previous, points, known, generation); });
  const auto sum_of = [&](Index Chunk::*number) {
    Index sum = 0;
    for (const Chunk& chunk : chunks_) sum += chunk.*number;
    return sum;
  };
  const auto iterate = [&](Index t) {
    for_each_chunk([&](Chunk& chunk) {
      chunk.reached =
          kernels_.find_means(rows_of(chunk), weights_of(chunk), moved_[0].values.data(), t,
                              revisits_, means_[0].values.data(), generation.data());
    });
    return sum_of(&Chunk::reached);
  };
  const Index unknown = sum_of(&Chunk::unknown);
  Index reached = 0;
  Index t = 0;  // at last T
  while (reached < unknown) {
    const Index now = iterate(t + 1);
    if (now == reached) break;  // the others are disconnected, and this iteration does not count
    reached = now;
    ++t;
    std::swap(moved_, means_);
  }
  for (Index extra = 1; extra <= (revisits_ ? extra_iterations_ : 0); ++extra) {
    iterate(t + extra);
    std::swap(moved_, means_);
  }
  for_each_chunk([&](Chunk& chunk) {
    for (const Index j : std::span(&rows_[chunk.first], at(chunk.unknown))) {
      if (generation[j] == Generations::disconnected) continue;
      const auto& [x, y, z, weight] = moved_[j].values;
      points[j] = previous[j] + (1 / weight) * Vector3{x, y, z};  // eq. (3)
    }
  });
  generations.set_counts(at(static_cast<Index>(previous.size()) - unknown), at(reached));
  return at(t + extra_iterations_);
}

/// Finds the motions of the anchors of a chunk, and s_ij = 1 / |v_i - v_j|^2 of the unknown
/// vertices. Lengths are in mean edges: eq. (4) depends only on ratios, and in this unit squares
/// stay in range.
void Motion::begin(Chunk& chunk, Field previous, Field points, std::span<const std::uint8_t> known,
                   std::span<Index> generation) {
  Index* row = &rows_[chunk.first];
  for (const Index v : std::span(order_).subspan(at(chunk.first), at(chunk.last - chunk.first))) {
    const std::uint8_t is_known = known[v];
    // Masks may be random, so that a branch would cost more than what it saves.
    const Vector3& now = is_known != 0 ? points[v] : previous[v];
    const auto d = now - previous[v];
    moved_[v] = means_[v] = {{d.x, d.y, d.z, static_cast<double>(is_known)}};
    generation[v] = Index{is_known} - 1;
    *row = v;
    row += 1 - is_known;
  }
  chunk.unknown = static_cast<Index>(row - &rows_[chunk.first]);
  static_assert(Generations::anchor == 0 && Generations::disconnected == -1);

  kernels_.weigh(rows_of(chunk), previous.data(), per_mean_edge_, weights_of(chunk));
}

}  // namespace dynmesh
