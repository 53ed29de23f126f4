/// Rows of measured points as anchors of the vertices that they touch.
#pragma once

#include <dynmesh/topology.hpp>
#include <dynmesh/types.hpp>
#include <span>
#include <vector>

#include "shape/shape_system.hpp"
#include "surface_fit/surface_rows.hpp"

namespace dynmesh {

/// Rows as noisy anchors, one for each vertex that they touch: the point of their mean plane that
/// is nearest to the vertex. The components that they touch are solved for.
struct PlaneAnchors {
  /// The anchors of rows on X (k,).
  PlaneAnchors(std::span<const SurfaceRow> rows, Field x, const Topology& topology);

  Anchors anchors;               ///< that observe positions
  std::vector<Vector3> normals;  ///< (k,) of the planes, of unit length; 0 without rows
};

}  // namespace dynmesh
