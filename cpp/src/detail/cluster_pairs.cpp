#include "detail/cluster_pairs.hpp"

#include <algorithm>
#include <cmath>

#include "support/geometry.hpp"

namespace dynmesh {

ClusterPairs::ClusterPairs(const Clusters& clusters, std::span<const Vector3<double>> first_frame)
    : beside_(clusters.neighbours),
      region_(clusters.size()),
      steps_(clusters.size()),
      distances_(clusters.size()),
      next_(clusters.size()),
      pair_of_(clusters.size()) {
  for (std::size_t c = 0; c < clusters.size(); ++c) {
    const Vector3<double>& centre = first_frame[clusters.centres[c]];
    for (const Index d : beside_[c]) {
      lengths_.push_back(std::sqrt(squared_norm(first_frame[clusters.centres[d]] - centre)));
    }
  }
  order_.reserve(clusters.size());
  pairs_.reserve(lengths_.size() / 2);
}

std::span<const ClusterPair> ClusterPairs::find(std::span<const std::uint8_t> has_anchors) {
  find_regions(has_anchors);
  std::ranges::fill(pair_of_, std::size_t{0});
  pairs_.clear();
  for (Index c = 0; c < static_cast<Index>(region_.size()); ++c) {
    if (has_anchors[c] != 0) pair_with_others(c);
  }
  return pairs_;
}

/// Searches breadth first, from all clusters with anchors at once.
void ClusterPairs::find_regions(std::span<const std::uint8_t> has_anchors) {
  order_.clear();
  for (Index c = 0; c < static_cast<Index>(region_.size()); ++c) {
    const bool is_first = has_anchors[c] != 0;
    region_[c] = is_first ? c : none;
    steps_[c] = 0;
    distances_[c] = 0;
    next_[c] = none;
    if (is_first) order_.push_back(c);
  }
  for (std::size_t i = 0; i < order_.size(); ++i) {
    const Index c = order_[i];
    for (Index e = beside_.offsets[c]; e < beside_.offsets[c + 1]; ++e) {
      const Index d = beside_.neighbours[e];
      const double distance = distances_[c] + lengths_[e];
      if (region_[d] == none) {
        order_.push_back(d);
        steps_[d] = steps_[c] + 1;
      } else if (steps_[d] != steps_[c] + 1 || distance > distances_[d] ||
                 (distance == distances_[d] && region_[c] >= region_[d])) {
        continue;
      }
      region_[d] = region_[c];
      distances_[d] = distance;
    }
  }
  for (const Index c : order_) {
    if (steps_[c] == 0) continue;
    next_[c] = next_[region_[c]];
    next_[region_[c]] = c;
  }
}

/// Pairs a region with those of higher numbers that it touches.
void ClusterPairs::pair_with_others(Index region) {
  const std::size_t first_pair = pairs_.size();
  for (Index c = region; c != none; c = next_[c]) {
    for (Index e = beside_.offsets[c]; e < beside_.offsets[c + 1]; ++e) {
      const Index d = beside_.neighbours[e];
      const Index other = region_[d];
      if (other <= region) continue;
      const double path = distances_[c] + lengths_[e] + distances_[d];
      std::size_t& pair = pair_of_[other];
      if (pair > first_pair) {
        pairs_[pair - 1].path = std::min(pairs_[pair - 1].path, path);
      } else {
        pairs_.push_back({region, other, path});
        pair = pairs_.size();
      }
    }
  }
}

}  // namespace dynmesh
