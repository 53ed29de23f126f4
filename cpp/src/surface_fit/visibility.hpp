/// Which parts of a surface its other parts hide from the sensors.
#pragma once

#include <cstdint>
#include <dynmesh/topology.hpp>
#include <dynmesh/types.hpp>
#include <span>
#include <vector>

#include "base/workers.hpp"

namespace dynmesh {

struct Visibility {
  /// (k,) 1 for vertices that another component hides from every sensor that they face.
  std::vector<std::uint8_t> is_hidden;
  /// (k,) 1 for vertices that face a sensor from which no other component hides them.
  std::vector<std::uint8_t> is_seen;
  /// (components,) the share of each in what the sensors see of the surface.
  std::vector<double> shares;
};

/// Draws the surface as each sensor sees it, with about two pixels for each mean edge (Catmull
/// 1974). `normals` (k,) are outward; vertices of sheets, (k,), face every sensor. Without sensors,
/// the surface is seen from far away on all sides; a sensor within its bounds sees all that faces
/// it. Of more than 24 sensors, so many are used at most, evenly chosen. The time is linear in the
/// number of triangles and of sensors.
Visibility find_visibility(std::span<const Triangle> faces, std::span<const Index> component,
                           Field x, Field normals, std::span<const std::uint8_t> is_sheet,
                           Field sensors, double mean_edge, Workers& workers);

}  // namespace dynmesh
