/// The rigid motions of all components of a surface, which ties join.
#pragma once

#include <dynmesh/topology.hpp>
#include <dynmesh/types.hpp>
#include <span>

#include "mesh/ties.hpp"
#include "surface_fit/constants.hpp"
#include "surface_fit/surface_rows.hpp"

namespace dynmesh {

/// Moves each component of X (k,) rigidly to the planes of its points, as `fit_to_planes` does,
/// while the ties keep the `differences` X_i - X_j, one for each, which turn with the components
/// (articulated ICP, linearised). Ties weigh as much as one point and, if components are within
/// `reach` of each other in frame 0, a share of the points of the one that has fewer, so that they
/// decide in directions of which points say little, and where there are none. `stiffness`
/// multiplies that. Returns the square of the largest distance that a vertex moved.
double move_jointly(std::span<const SurfaceRow> rows, std::span<const Tie> ties, double reach,
                    double stiffness, const Topology& topology, const TrackingConstants& constants,
                    std::span<Vector3> x, std::span<Vector3> differences);

}  // namespace dynmesh
