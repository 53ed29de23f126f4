/// What holds the components of a surface together.
#pragma once

#include <cstdint>
#include <dynmesh/topology.hpp>
#include <dynmesh/types.hpp>
#include <span>
#include <vector>

#include "tracking/constants.hpp"

namespace dynmesh {

/// Two vertices of different components whose difference is kept, with the weight of that.
struct Tie {
  std::uint32_t i = 0;
  std::uint32_t j = 0;
  double weight = 0;
};

/// Ties some of the vertices of each component that are nearest to others in frame 0, well spread,
/// each to the nearest vertex of another component. None for a single component.
std::vector<Tie> find_ties(const Topology& topology, std::span<const Vector3<double>> first_frame,
                           double mean_edge, const TrackingConstants& constants);

}  // namespace dynmesh
