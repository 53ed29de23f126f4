/// Colours of a surface, which tell where a point lies along it, as its shape hardly does.
#pragma once

#include <dynmesh/types.hpp>
#include <span>
#include <vector>

#include "base/workers.hpp"
#include "shape/memory.hpp"
#include "surface_fit/constants.hpp"
#include "surface_fit/surface_matcher.hpp"

namespace dynmesh {

/// Adds rows that draw the places of points on X along the surface, to where it has the colours of
/// the points (Park et al. 2017). What is common to the differences around a vertex, as of light
/// and exposure, is left out. Colours vary linearly on each triangle.
void add_colour_rows(std::span<const Triangle> faces, Field x, const SurfaceColours& colours,
                     const MatchedPoints& points, const TrackingConstants& constants,
                     const Clusters& clusters, Workers& workers, std::vector<SurfaceRow>& rows);

/// Fits the colours of vertices that have none yet to those of the points around them. Others stay,
/// since what is learned while the surface slides along itself would let it go on.
void learn_colours(const MatchedPoints& points, const TrackingConstants& constants,
                   SurfaceColours& colours);

}  // namespace dynmesh
