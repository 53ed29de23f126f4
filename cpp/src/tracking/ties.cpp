#include "tracking/ties.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "stream/disconnected.hpp"
#include "support/geometry.hpp"

namespace dynmesh {
namespace {

struct Pair {
  std::uint32_t vertex = 0;
  std::uint32_t other = 0;
  double distance = 0;  // in mean edges
};

/// Chooses at most `n` of the pairs, each the one that is farthest from those before it.
std::vector<Pair> spread(const std::vector<Pair>& pairs, std::size_t n,
                         std::span<const Vector3<double>> x) {
  if (pairs.size() <= n) return pairs;
  std::vector<Pair> chosen;
  std::vector<double> nearest(pairs.size(), std::numeric_limits<double>::infinity());
  for (std::size_t next = 0; chosen.size() < n;) {
    chosen.push_back(pairs[next]);
    for (std::size_t i = 0; i < pairs.size(); ++i) {
      nearest[i] = std::min(nearest[i], squared_norm(x[pairs[i].vertex] - x[chosen.back().vertex]));
    }
    next = static_cast<std::size_t>(std::ranges::max_element(nearest) - nearest.begin());
  }
  return chosen;
}

}  // namespace

std::vector<Tie> find_ties(const Topology& topology, std::span<const Vector3<double>> first_frame,
                           double mean_edge, const TrackingConstants& constants) {
  if (topology.report.components < 2) return {};
  const std::vector<Index> nearest = find_donors(first_frame, topology.component);
  std::vector<std::vector<Pair>> pairs(topology.report.components);
  for (std::uint32_t v = 0; v < first_frame.size(); ++v) {
    const auto other = static_cast<std::uint32_t>(nearest[v]);
    const double distance = std::sqrt(squared_norm(first_frame[v] - first_frame[other]));
    pairs[static_cast<std::size_t>(topology.component[v])].push_back(
        {v, other, distance / mean_edge});
  }
  std::vector<Tie> ties;
  for (auto& of_component : pairs) {
    std::ranges::stable_sort(of_component, {}, &Pair::distance);
    const double reach =
        of_component.empty() ? 0 : of_component[0].distance + constants.tied_within;
    const auto beyond = std::ranges::upper_bound(of_component, reach, {}, &Pair::distance);
    const auto near = static_cast<std::size_t>(beyond - of_component.begin());
    of_component.resize(std::min(of_component.size(), std::max(near, constants.fewest_ties)));
    for (const Pair& pair : spread(of_component, constants.most_ties, first_frame)) {
      const double weight = constants.tie_weight / (1 + pair.distance * pair.distance);
      ties.push_back({pair.vertex, pair.other, weight});
    }
  }
  return ties;
}

}  // namespace dynmesh
