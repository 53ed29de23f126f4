/// Components whose points lie elsewhere than where they were expected.
#pragma once

#include <cstdint>
#include <dynmesh/topology.hpp>
#include <dynmesh/types.hpp>
#include <span>

#include "surface_fit/constants.hpp"
#include "surface_fit/surface_matcher.hpp"
#include "surface_fit/visibility.hpp"

namespace dynmesh {

/// Moves the components of X (k,) that are lost to points that no component explains, the largest
/// first, and returns whether any was found. `is_placed` (components,) is 0 for those that are
/// lost, and `points` have their nearest places on X, which has these `normals` (k,).
///
/// What sensors should see of a component is put at each cluster of points of about its size, the
/// nearest first, and moved rigidly to the points there (Chen and Medioni 1992). It is found where
/// most of it has points, which then are explained. The time is that of some hundred searches for
/// each cluster.
bool find_lost(std::span<const std::uint8_t> is_placed, const MatchedPoints& points,
               const Visibility& visibility, Field normals, const Topology& topology,
               const TrackingConstants& constants, std::span<Vector3> x);

}  // namespace dynmesh
