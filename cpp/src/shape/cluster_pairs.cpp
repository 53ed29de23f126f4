#include "shape/cluster_pairs.hpp"

#include <algorithm>
#include <cmath>
#include <tuple>
#include <utility>

#include "base/geometry.hpp"

namespace dynmesh {

ClusterGraph::ClusterGraph(const Clusters& clusters, Field first_frame)
    : beside_(clusters.neighbours),
      pairs_({}, 1),
      steps_(clusters.size()),
      region_(clusters.size()),
      distances_(clusters.size()),
      next_(clusters.size()),
      pair_of_(clusters.size()) {
  for (std::size_t c = 0; c < clusters.size(); ++c) {
    const Vector3& centre = first_frame[clusters.centres[c]];
    for (const Index d : beside_[c]) {
      lengths_.push_back(std::sqrt(squared_norm(first_frame[clusters.centres[d]] - centre)));
    }
  }
  pairs_.lend().pairs.reserve(lengths_.size() / 2);
}

Lent<ClusterPairs> ClusterGraph::pairs(std::span<const std::uint8_t> has_anchors) {
  find_regions(has_anchors);
  std::ranges::fill(pair_of_, std::size_t{0});
  Lent<ClusterPairs> found = pairs_.lend();
  found.pairs.clear();
  for (Index c = 0; c < static_cast<Index>(region_.size()); ++c) {
    if (has_anchors[c] != 0) pair_with_others(c, found.pairs);
  }
  found.farthest = steps_.last();
  return found;
}

/// Gives each cluster the region of one of its neighbours that is a step nearer.
void ClusterGraph::find_regions(std::span<const std::uint8_t> has_anchors) {
  steps_.classify(beside_, has_anchors);
  const auto steps = steps_.of_vertices();
  for (Index c = 0; c < static_cast<Index>(region_.size()); ++c) {
    region_[c] = has_anchors[c] != 0 ? c : none;
    distances_[c] = 0;
    next_[c] = none;
  }
  for (const Index c : steps_.satellites()) {
    for (Index e = beside_.offsets[c]; e < beside_.offsets[c + 1]; ++e) {
      const Index d = beside_.neighbours[e];
      if (steps[d] != steps[c] - 1) continue;
      const std::pair way(distances_[d] + lengths_[e], region_[d]);
      if (region_[c] != none && std::pair(distances_[c], region_[c]) <= way) continue;
      std::tie(distances_[c], region_[c]) = way;
    }
    next_[c] = next_[region_[c]];
    next_[region_[c]] = c;
  }
}

/// Pairs a region with those of higher numbers that it touches.
void ClusterGraph::pair_with_others(Index region, std::vector<ClusterPair>& pairs) {
  const std::size_t first_pair = pairs.size();
  for (Index c = region; c != none; c = next_[c]) {
    for (Index e = beside_.offsets[c]; e < beside_.offsets[c + 1]; ++e) {
      const Index d = beside_.neighbours[e];
      const Index other = region_[d];
      if (other <= region) continue;
      const double path = distances_[c] + lengths_[e] + distances_[d];
      std::size_t& pair = pair_of_[other];
      if (pair > first_pair) {
        pairs[pair - 1].path = std::min(pairs[pair - 1].path, path);
      } else {
        pairs.push_back({region, other, path});
        pair = pairs.size();
      }
    }
  }
}

}  // namespace dynmesh
