#include "shape/modes.hpp"

#include <cmath>
#include <utility>

#include "base/shortest_paths.hpp"
#include "base/statistics.hpp"

namespace dynmesh {
namespace {

/// Farthest-point sampling. There are fewer seeds if all vertices coincide with one.
std::vector<std::size_t> seeds_of(Field frame, Index n_seeds) {
  Vector3 mean{};
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

SurfaceParts divide_surface(const Cells& cells, Field frame, Index local_parts) {
  const auto along_edges = [&](std::size_t v, const auto& visit) {
    for (const Index n : cells[v]) visit(at(n), std::sqrt(squared_norm(frame[n] - frame[v])));
  };
  std::vector<std::vector<double>> distances;
  for (const std::size_t seed : seeds_of(frame, local_parts)) {
    distances.push_back(shortest_paths(frame.size(), seed, along_edges));
  }
  const double reach = training_constants.reach * typical_distance(distances, frame.size());
  if (!(reach > 0)) distances.clear();

  SurfaceParts parts;
  parts.n_parts = static_cast<Index>(distances.size()) + 1;
  std::vector<double> weights(distances.size());
  for (std::size_t v = 0; v < frame.size(); ++v) {
    const auto add = [&](std::size_t part, double weight) {
      parts.parts.push_back(static_cast<Index>(part));
      parts.weights.push_back(weight);
    };
    add(0, 1);
    double sum = 0;
    for (std::size_t c = 0; c < distances.size(); ++c) {
      const double ratio = distances[c][v] / reach;
      weights[c] = std::exp(-ratio * ratio / 2);
      sum += weights[c];
    }
    double kept = 0;
    for (double& weight : weights) {
      weight = sum > 0 && weight >= training_constants.least_weight * sum ? weight : 0;
      kept += weight;
    }
    for (std::size_t c = 0; c < weights.size(); ++c) {
      if (weights[c] > 0) add(c + 1, weights[c] / kept);
    }
    parts.offsets.push_back(static_cast<Index>(parts.parts.size()));
  }
  return parts;
}

Modes::Modes(SurfaceParts parts, double mean_edge)
    : parts_(std::move(parts)),
      n_coefficients_(static_cast<std::size_t>(modes_of_part * parts_.n_parts)),
      unit_(std::exp2(std::ilogb(mean_edge))),
      values_(3 * modes_of_part * parts_.parts.size()) {}

void Modes::form(const ShapeData& shapes, const CombinationData& combinations, std::size_t size,
                 Workers& workers) {
  const auto k = static_cast<Index>(parts_.size());
  workers.for_each_short_chunk(k, [&](Index first, Index last) {
    best_kernels().modes.form(data(), shapes, combinations, values_.data(), first, last);
  });
  size_ = size;
  n_frames_ = at(combinations.n_slots);
}

void Modes::combine(std::span<const double> coefficients, std::span<Vector3> combined,
                    ModeSums& sums, Workers& workers) const {
  std::ranges::transform(coefficients, sums.coefficients.begin(),
                         [](double a) { return static_cast<float>(a); });
  const auto k = static_cast<Index>(combined.size());
  workers.for_each_short_chunk(k, [&](Index first, Index last) {
    best_kernels().modes.combine(data(), sums.coefficients.data(), combined.data(), first, last);
    for (Index v = first; v < last; ++v) combined[v] = unit_ * combined[v];
  });
}

void Modes::project(Field field, std::span<double> projected, std::span<const double> weights,
                    std::span<double> squares, ModeSums& sums, Workers& workers) const {
  const std::size_t n = n_coefficients_;
  const auto add = [&](float* partial, Index first, Index last) {
    best_kernels().modes.project(data(), field.data(), weights.data(), partial, partial + n, first,
                                 last);
  };
  const auto found = sums.of_vertices.find(weights.empty() ? n : 2 * n, workers, add);
  for (std::size_t j = 0; j < n; ++j) projected[j] = unit_ * found[j];
  for (std::size_t j = n; j < found.size(); ++j) squares[j - n] = unit_ * unit_ * found[j];
}

}  // namespace dynmesh
