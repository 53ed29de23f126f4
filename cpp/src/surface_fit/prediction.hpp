/// Where the vertices of a surface are expected in the next frame.
#pragma once

#include <cstddef>
#include <dynmesh/types.hpp>
#include <span>
#include <vector>

#include "shape/memory.hpp"
#include "shape/model.hpp"
#include "surface_fit/constants.hpp"
#include "surface_fit/learned_ties.hpp"
#include "surface_fit/surface_matcher.hpp"

namespace dynmesh {

/// X + share (X - before) replaces X, and X replaces `before`.
void extrapolate(std::span<Vector3> x, std::span<Vector3> before, double share);

struct Prediction {
  std::vector<Vector3> x;  ///< (k,)
  Visibility visibility;   ///< about that of x
};

/// The frame that the last two lead to, or the last one if it is clearly nearer to the points: a
/// step that brought the surface to where it was all the time leads past it. Then the components
/// that `ties` hold together begin where their points show them. `points`
/// are those of the frame, of which about `n_points` suffice.
Prediction predict(const Memory& memory, const ShapeModel& model,
                   const TrackingConstants& constants, std::size_t n_points,
                   const WeightedTies& ties, SurfaceMatcher& matcher, MatchedPoints& points);

}  // namespace dynmesh
