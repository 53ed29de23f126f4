#include "detail/modes.hpp"

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <queue>
#include <utility>

#include "support/geometry.hpp"

namespace dynmesh {
namespace {

/// Sums of float are short, so that they are as accurate as their terms. The chunks do not depend
/// on the number of threads, and neither do the sums.
constexpr Index chunk = 256;

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
    for (const Index n : cells[v]) {
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

Modes::Modes(const SurfaceParts& parts, double mean_edge)
    : n_coefficients_(static_cast<std::size_t>(modes_of_part * parts.n_parts)),
      offsets_(parts.offsets),
      unit_(std::exp2(std::ilogb(mean_edge))),
      values_(3 * modes_of_part * parts.entries.size()),
      coefficients_(n_coefficients_) {
  parts_.reserve(parts.entries.size());
  for (const auto& entry : parts.entries) parts_.push_back(entry.part);
  const std::size_t k = offsets_.size() - 1;
  partial_sums_.resize((k + chunk - 1) / chunk * 2 * n_coefficients_);
}

void Modes::form(const ShapeData& shapes, const CombinationData& combinations, std::size_t size,
                 std::size_t n_frames, Workers& workers) {
  const auto k = static_cast<Index>(offsets_.size() - 1);
  workers.share((k + chunk - 1) / chunk, workers.are_worth_it(k), [&](Index i) {
    best_kernels().modes.form(data(), shapes, combinations, values_.data(), i * chunk,
                              std::min(k, (i + 1) * chunk));
  });
  size_ = size;
  n_frames_ = n_frames;
}

void Modes::combine(std::span<const double> coefficients, std::span<Vector3<double>> combined,
                    Workers& workers) {
  std::ranges::transform(coefficients, coefficients_.begin(),
                         [](double a) { return static_cast<float>(a); });
  const auto k = static_cast<Index>(combined.size());
  workers.share((k + chunk - 1) / chunk, workers.are_worth_it(k), [&](Index i) {
    const Index first = i * chunk;
    const Index last = std::min(k, first + chunk);
    best_kernels().modes.combine(data(), coefficients_.data(), combined.data(), first, last);
    for (Index v = first; v < last; ++v) {
      auto& x = combined[v];
      x = unit_ * x;
    }
  });
}

/// Computes `n_sums` partial sums of each chunk of vertices.
template <class Kernel>
void Modes::add_up(std::size_t n_sums, Workers& workers, const Kernel& kernel) {
  const auto k = static_cast<Index>(offsets_.size() - 1);
  workers.share((k + chunk - 1) / chunk, workers.are_worth_it(k), [&](Index i) {
    float* sums = &partial_sums_[static_cast<std::size_t>(i) * n_sums];
    std::fill_n(sums, n_sums, 0.0F);
    kernel(sums, i * chunk, std::min(k, (i + 1) * chunk));
  });
}

/// Adds up the partial sums from the `first` of `n_sums` on, in this unit.
void Modes::reduce(std::size_t first, std::size_t n_sums, double unit,
                   std::span<double> sums) const {
  std::ranges::fill(sums, 0.0);
  const std::size_t n_chunks = (offsets_.size() - 1 + chunk - 1) / chunk;
  for (std::size_t i = 0; i < n_chunks; ++i) {
    for (std::size_t j = 0; j < sums.size(); ++j) {
      sums[j] += static_cast<double>(partial_sums_[i * n_sums + first + j]);
    }
  }
  for (double& sum : sums) sum *= unit;
}

void Modes::project(Field field, std::span<double> projected, Workers& workers) {
  const std::size_t n = n_coefficients_;
  add_up(n, workers, [&](float* sums, Index first, Index last) {
    best_kernels().modes.project(data(), field.data(), sums, first, last);
  });
  reduce(0, n, unit_, projected);
}

void Modes::project_and_weigh(Field field, std::span<const double> weights,
                              std::span<double> projected, std::span<double> squares,
                              Workers& workers) {
  const std::size_t n = n_coefficients_;
  add_up(2 * n, workers, [&](float* sums, Index first, Index last) {
    best_kernels().modes.project_and_weigh(data(), field.data(), weights.data(), sums, sums + n,
                                           first, last);
  });
  reduce(0, 2 * n, unit_, projected);
  reduce(n, 2 * n, unit_ * unit_, squares);
}

}  // namespace dynmesh
