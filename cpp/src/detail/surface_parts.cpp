#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <queue>
#include <utility>

#include "detail/modes.hpp"
#include "support/geometry.hpp"

namespace dynmesh {
namespace {

constexpr double unreached = std::numeric_limits<double>::infinity();

/// Farthest-point sampling. There are fewer seeds if all vertices coincide with one.
std::vector<std::size_t> seeds_of(std::span<const Vector3<double>> frame, Index n_seeds) {
  Vector3<double> mean{};
  for (const auto& x : frame) mean = mean + (1 / static_cast<double>(frame.size())) * x;
  std::vector<double> distance(frame.size());
  std::ranges::transform(frame, distance.begin(),
                         [&](const auto& x) { return squared_norm(x - mean); });
  std::vector<std::size_t> seeds;
  while (std::ssize(seeds) < n_seeds) {
    const auto farthest = std::ranges::max_element(distance);
    if (!(*farthest > 0)) break;
    seeds.push_back(static_cast<std::size_t>(farthest - distance.begin()));
    for (std::size_t v = 0; v < frame.size(); ++v) {
      const double to_seed = squared_norm(frame[v] - frame[seeds.back()]);
      distance[v] = seeds.size() == 1 ? to_seed : std::min(distance[v], to_seed);
    }
  }
  return seeds;
}

/// The lengths of the shortest paths along edges (Dijkstra).
std::vector<double> distances_from(std::size_t seed, const Cells& cells,
                                   std::span<const Vector3<double>> frame) {
  using Reached = std::pair<double, std::size_t>;
  std::vector<double> distance(frame.size(), unreached);
  std::priority_queue<Reached, std::vector<Reached>, std::greater<>> next;
  distance[seed] = 0;
  next.emplace(0.0, seed);
  while (!next.empty()) {
    const auto [length, v] = next.top();
    next.pop();
    if (length > distance[v]) continue;
    for (const Index neighbour : cells[static_cast<Index>(v)]) {
      const auto n = static_cast<std::size_t>(neighbour);
      const double longer = length + std::sqrt(squared_norm(frame[n] - frame[v]));
      if (longer >= distance[n]) continue;
      distance[n] = longer;
      next.emplace(longer, n);
    }
  }
  return distance;
}

/// The median of the second smallest distance of each vertex, where there is one; else 0.
double typical_distance(const std::vector<std::vector<double>>& distances, std::size_t n_vertices) {
  std::vector<double> second;
  for (std::size_t v = 0; v < n_vertices; ++v) {
    double nearest = unreached;
    double next = unreached;
    for (const auto& of_seed : distances) {
      next = std::min(next, std::max(nearest, of_seed[v]));
      nearest = std::min(nearest, of_seed[v]);
    }
    if (next < unreached) second.push_back(next);
  }
  return second.empty() ? 0 : median(second);
}

}  // namespace

SurfaceParts divide_surface(const Cells& cells, std::span<const Vector3<double>> frame,
                            const TrainingConstants& constants) {
  std::vector<std::vector<double>> distances;
  for (const std::size_t seed : seeds_of(frame, constants.local_parts)) {
    distances.push_back(distances_from(seed, cells, frame));
  }
  const double reach = constants.reach * typical_distance(distances, frame.size());
  if (!(reach > 0)) distances.clear();

  SurfaceParts parts;
  parts.n_parts = static_cast<Index>(distances.size()) + 1;
  parts.offsets.assign(frame.size() + 1, 0);
  std::vector<double> weights(distances.size());
  for (std::size_t v = 0; v < frame.size(); ++v) {
    parts.entries.push_back({0, 1.0});
    double sum = 0;
    for (std::size_t c = 0; c < distances.size(); ++c) {
      const double ratio = distances[c][v] / reach;
      weights[c] = std::exp(-ratio * ratio / 2);
      sum += weights[c];
    }
    double kept = 0;
    for (double& weight : weights) {
      weight = sum > 0 && weight >= constants.least_weight * sum ? weight : 0;
      kept += weight;
    }
    for (std::size_t c = 0; c < weights.size(); ++c) {
      if (weights[c] > 0) parts.entries.push_back({static_cast<Index>(c) + 1, weights[c] / kept});
    }
    parts.offsets[v + 1] = static_cast<Index>(parts.entries.size());
  }
  return parts;
}

}  // namespace dynmesh
