/// Which clusters with anchors are beside each other on the surface.
#pragma once

#include <cstddef>
#include <cstdint>
#include <dynmesh/topology.hpp>
#include <dynmesh/types.hpp>
#include <span>
#include <vector>

#include "frame/generations.hpp"
#include "shape/rotations.hpp"

namespace dynmesh {

struct ClusterPair {
  Index a = 0;
  Index b = 0;
  double path = 0;  ///< the length of a path from centre to centre that joins them, in frame 0
};

/// Divides the clusters into regions, those that are nearest to each cluster with anchors, and
/// pairs the clusters whose regions touch. Nearest is the one to which the shortest path from
/// centre to centre leads, among the paths with the fewest steps; of several, that with the lowest
/// number, so that pairs depend on the numbers of the vertices as little as clusters do. Allocates
/// memory only in the constructor.
class ClusterPairs {
 public:
  /// `clusters` must outlive this object.
  ClusterPairs(const Clusters& clusters, Field first_frame);

  /// Pairs the clusters with `has_anchors[c] != 0`, each pair once and with the shortest of the
  /// paths through the steps between the two regions. The pairs are valid until the next call. The
  /// time is linear in the number of clusters.
  std::span<const ClusterPair> find(std::span<const std::uint8_t> has_anchors);

  /// The largest number of steps from a cluster to the nearest one with anchors, in the last call.
  [[nodiscard]] Index farthest() const { return steps_.last(); }

 private:
  void find_regions(std::span<const std::uint8_t> has_anchors);
  void pair_with_others(Index region);

  const Cells& beside_;
  std::vector<double> lengths_;  // of the steps, in the order of `beside_`
  // Of the last call, by clusters:
  Generations steps_;                 // to the nearest cluster with anchors
  std::vector<Index> region_;         // that cluster
  std::vector<double> distances_;     // from it
  std::vector<Index> next_;           // the next cluster of the same region
  std::vector<std::size_t> pair_of_;  // the number of the last pair of each region, from 1
  std::vector<ClusterPair> pairs_;
};

}  // namespace dynmesh
