#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>

#include "mesh/generations.hpp"
#include "whole_frame/trips.hpp"

namespace dynmesh {
namespace {

constexpr double infinite = std::numeric_limits<double>::infinity();

/// Of vertex v on one side; not normalised. The exponent would be -2 if standard errors were exact;
/// as they are estimates, it is smaller. Infinity where the standard error is 0.
double weight_of(const SideResult& side, std::size_t v, const WholeFrameConstants& constants) {
  return (side.seen[v] != 0 ? 1 : constants.never_seen) * std::pow(side.standard_error[v], -1.5);
}

}  // namespace

Combination combine(std::span<const SideResult> results, const WholeFrameConstants& constants) {
  const std::size_t k = results.front().positions.size();
  Combination combination{std::vector<Vector3<double>>(k), std::vector<double>(k),
                          std::vector<double>(k)};
  std::vector<double> weights(results.size());
  for (std::size_t v = 0; v < k; ++v) {
    double sum = 0;
    for (std::size_t q = 0; q < results.size(); ++q) {
      weights[q] = weight_of(results[q], v, constants);
      sum += weights[q];
    }
    // Both sides know the vertex exactly, or neither knows anything of it.
    const bool are_equal = !(sum > 0) || std::isinf(sum);
    for (double& weight : weights) {
      weight = are_equal ? 1 / static_cast<double>(results.size()) : weight / sum;
    }
    for (std::size_t q = 0; q < results.size(); ++q) {
      combination.positions[v] = combination.positions[v] + weights[q] * results[q].positions[v];
    }
    for (std::size_t q = 0; q < results.size(); ++q) {
      if (weights[q] == 0) continue;  // of an infinite standard error
      const double error = results[q].standard_error[v];
      const auto difference = results[q].positions[v] - combination.positions[v];
      combination.disagreement[v] += weights[q] * squared_norm(difference) / 3;
      combination.error_of_sides[v] += weights[q] * error * error;
    }
  }
  return combination;
}

std::vector<double> standard_errors(const Combination& combination, const Cells& cells,
                                    std::span<const std::uint8_t> known,
                                    std::span<const std::uint8_t> seen, double typical_length,
                                    bool has_noise, const WholeFrameConstants& constants) {
  const std::size_t k = known.size();
  std::vector<std::uint8_t> unseen(k);
  std::ranges::transform(seen, unseen.begin(),
                         [](std::uint8_t s) { return static_cast<std::uint8_t>(s == 0); });
  const auto edges_to = [&](std::span<const std::uint8_t> nearest) {
    Generations generations(k);
    generations.classify(cells, nearest);
    const auto all = generations.of_vertices();
    return std::vector<Index>(all.begin(), all.end());
  };
  const auto to_known = edges_to(known);
  const auto to_seen = edges_to(seen);
  const auto to_unseen = edges_to(unseen);

  std::vector<double> errors(k);
  for (std::size_t v = 0; v < k; ++v) {
    const double of_sides = combination.error_of_sides[v];
    if (to_known[v] == Generations::anchor) {
      errors[v] = has_noise ? std::sqrt(of_sides) : 0;
      continue;
    }
    if (to_known[v] == Generations::disconnected) {
      errors[v] = infinite;
      continue;
    }
    const double error =
        constants.error_scale *
        std::sqrt(constants.error_of_sides * of_sides + combination.disagreement[v]) *
        std::sqrt(static_cast<double>(to_known[v]));
    if (seen[v] != 0) {
      const int far = constants.farthest_unseen;
      const int distance = to_unseen[v] == Generations::disconnected ? far : to_unseen[v];
      errors[v] = error * (1 + constants.error_near_unseen / std::min(distance, far));
    } else {
      const double distance = std::min(to_seen[v], constants.farthest_seen);
      errors[v] = std::max(
          constants.error_of_unseen * error,
          constants.shape_of_unseen * typical_length * std::pow(distance, constants.shape_growth));
    }
  }
  return errors;
}

}  // namespace dynmesh
