/// What holds the components of a surface together.
#pragma once

#include <dynmesh/topology.hpp>
#include <dynmesh/types.hpp>
#include <span>
#include <vector>

#include "detail/anchors.hpp"
#include "tracking/constants.hpp"

namespace dynmesh {

/// Ties some of the vertices of each component that are nearest to others in frame 0, well spread,
/// each to the nearest vertex of another component. None for a single component.
std::vector<Tie> find_ties(const Topology& topology, std::span<const Vector3<double>> first_frame,
                           double mean_edge, const TrackingConstants& constants);

}  // namespace dynmesh
