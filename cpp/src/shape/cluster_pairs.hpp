/// Which clusters with anchors are beside each other on the surface.
#pragma once

#include <cstddef>
#include <cstdint>
#include <dynmesh/topology.hpp>
#include <dynmesh/types.hpp>
#include <span>
#include <vector>

#include "base/lender.hpp"
#include "frame/generations.hpp"
#include "mesh/clusters.hpp"

namespace dynmesh {

struct ClusterPair {
  Index a = 0;
  Index b = 0;
  double path = 0;  ///< the length of a path from centre to centre that joins them, in frame 0
};

/// Clusters with anchors.
struct ClusterPairs {
  std::vector<ClusterPair> pairs;  ///< each once, with the shortest of the paths that join them
  Index farthest = 0;  ///< the largest number of steps from a cluster to the nearest one of these
};

/// Divides the clusters into regions, those that are nearest to each cluster with anchors, and
/// pairs the clusters whose regions touch. Nearest is the one to which the shortest path from
/// centre to centre leads, among the paths with the fewest steps; of several, that with the lowest
/// number, so that pairs depend on the numbers of the vertices as little as clusters do. Allocates
/// memory only in the constructor.
class ClusterGraph {
 public:
  /// `clusters` must outlive this object.
  ClusterGraph(const Clusters& clusters, Field first_frame);

  /// Pairs the clusters with `has_anchors[c] != 0`, by paths through the steps between two regions.
  /// The time is linear in the number of clusters.
  Lent<ClusterPairs> pairs(std::span<const std::uint8_t> has_anchors);

 private:
  void find_regions(std::span<const std::uint8_t> has_anchors);
  void pair_with_others(Index region, std::vector<ClusterPair>& pairs);

  const Cells& beside_;
  std::vector<double> lengths_;  // of the steps, in the order of `beside_`
  Lender<ClusterPairs> pairs_;
  // Buffers, by clusters:
  Generations steps_;                 // to the nearest cluster with anchors
  std::vector<Index> region_;         // that cluster
  std::vector<double> distances_;     // from it
  std::vector<Index> next_;           // the next cluster of the same region
  std::vector<std::size_t> pair_of_;  // the number of the last pair of each region, from 1
};

}  // namespace dynmesh
