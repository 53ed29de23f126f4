#include "shape/modes.hpp"

#include <array>
#include <cmath>
#include <numeric>
#include <utility>

#include "base/shortest_paths.hpp"
#include "base/statistics.hpp"

namespace dynmesh {
namespace {

/// A number for each mode of a part.
using ModeNumbers = std::array<float, modes_of_part>;

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

void Modes::form(const ModeFactors& combinations, std::size_t size, Workers& workers) {
  const std::size_t n = combinations.slots.size();
  const std::size_t slots = combinations.shapes.size() / 3 / parts_.size();
  workers.for_each_in_chunks(parts_.size(), [&](std::size_t v) {
    const float* shapes = &combinations.shapes[3 * slots * v];
    for (Index e = parts_.offsets[v]; e < parts_.offsets[v + 1]; ++e) {
      ModeNumbers sums[3] = {};
      const float* factors = &combinations.factors[modes_of_part * n * at(parts_.parts[e])];
      for (const Index slot : combinations.slots) {
        for (std::size_t c = 0; c < 3; ++c) {
          const float number = shapes[c * slots + at(slot)];
          for (std::size_t j = 0; j < modes_of_part; ++j) sums[c][j] += number * factors[j];
        }
        factors += modes_of_part;
      }
      const auto weight = static_cast<float>(parts_.weights[e]);
      float* mode = &values_[3 * modes_of_part * at(e)];
      for (const ModeNumbers& of_axis : sums) {
        for (const float sum : of_axis) *mode++ = weight * sum;
      }
    }
  });
  size_ = size;
  n_frames_ = n;
}

void Modes::combine(std::span<const double> coefficients, std::span<Vector3> combined,
                    ModeSums& sums, Workers& workers) const {
  std::ranges::transform(coefficients, sums.coefficients.begin(),
                         [](double a) { return static_cast<float>(a); });
  workers.for_each_in_chunks(combined.size(), [&](std::size_t v) {
    ModeNumbers products[3] = {};
    for (Index e = parts_.offsets[v]; e < parts_.offsets[v + 1]; ++e) {
      const float* mode = &values_[3 * modes_of_part * at(e)];
      const float* a = &sums.coefficients[modes_of_part * at(parts_.parts[e])];
      for (std::size_t c = 0; c < 3; ++c) {
        for (std::size_t j = 0; j < modes_of_part; ++j) {
          products[c][j] += a[j] * mode[modes_of_part * c + j];
        }
      }
    }
    const auto sum_of = [](const ModeNumbers& numbers) {
      return std::accumulate(numbers.begin(), numbers.end(), 0.0);
    };
    combined[v] = unit_ * Vector3{sum_of(products[0]), sum_of(products[1]), sum_of(products[2])};
  });
}

void Modes::project(Field field, std::span<double> projected, std::span<const double> weights,
                    std::span<double> squares, ModeSums& sums, Workers& workers) const {
  const std::size_t n = n_coefficients_;
  const auto add = [&](float* partial, Index first, Index last) {
    for (Index v = first; v < last; ++v) {
      const float at_v[3] = {static_cast<float>(field[at(v)].x), static_cast<float>(field[at(v)].y),
                             static_cast<float>(field[at(v)].z)};
      const float weight = weights.empty() ? 0.0F : static_cast<float>(weights[at(v)]);
      for (Index e = parts_.offsets[at(v)]; e < parts_.offsets[at(v) + 1]; ++e) {
        const float* x = &values_[3 * modes_of_part * at(e)];
        const float* y = x + modes_of_part;
        const float* z = y + modes_of_part;
        float* sum = partial + modes_of_part * parts_.parts[e];
        for (std::size_t j = 0; j < modes_of_part; ++j) {
          sum[j] += at_v[0] * x[j] + at_v[1] * y[j] + at_v[2] * z[j];
        }
        if (weights.empty()) continue;
        float* square = sum + n;
        for (std::size_t j = 0; j < modes_of_part; ++j) {
          square[j] += weight * (x[j] * x[j] + y[j] * y[j] + z[j] * z[j]);
        }
      }
    }
  };
  sums.of_vertices.find(weights.empty() ? n : 2 * n, workers, add, [&](std::size_t j, double sum) {
    (j < n ? projected[j] : squares[j - n]) = j < n ? unit_ * sum : unit_ * unit_ * sum;
  });
}

}  // namespace dynmesh
