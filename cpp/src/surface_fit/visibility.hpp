/// Which parts of a surface its other parts hide from the sensors.
#pragma once

#include <cstdint>
#include <dynmesh/topology.hpp>
#include <dynmesh/types.hpp>
#include <span>
#include <vector>

#include "base/workers.hpp"

namespace dynmesh {

/// What sensors can see of a surface of several components; empty for a single one.
struct Visibility {
  /// (k,) 1 for vertices that face a sensor from which no other component hides them.
  std::vector<std::uint8_t> is_seen;
  /// (faces,) 1 for triangles of which another component hides each corner from every sensor that
  /// the corner faces.
  std::vector<std::uint8_t> is_hidden;
  /// (components,) the share of each in what the sensors see of the surface.
  std::vector<double> shares;

  /// Whether a point can lie on a triangle: it belongs to the outermost layer on its line of sight.
  [[nodiscard]] bool shows(std::uint32_t face) const {
    return is_hidden.empty() || is_hidden[face] == 0;
  }
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
