/// A surface that was bent into a scan: its areas, and where its parts lie on each other.
#pragma once

#include <cstdint>
#include <dynmesh/topology.hpp>
#include <dynmesh/types.hpp>
#include <span>
#include <vector>

namespace dynmesh {

/// A surface (k,) with outward unit normals at its vertices, and the template from which it was
/// bent. `is_sheet` (k,) are the vertices that can be seen from behind.
struct BentSurface {
  std::span<const Triangle> faces;
  const Topology& topology;
  Field first_frame;
  Field x;
  Field normals;
  std::span<const std::uint8_t> is_sheet;
  double mean_edge = 1;
  double size = 1;  ///< as size_of
};

/// (k,) the area around each vertex: a third of its triangles.
std::vector<double> areas_of(std::span<const Triangle> faces, Field x);

/// The area of the largest connected piece of the vertices (k,) that are marked.
double largest_piece(const Cells& cells, std::span<const double> areas,
                     std::vector<std::uint8_t> is_in);

/// The share of the template's area where another part lies as well and faces the same way. No
/// surface does: something that was not measured was drawn to the points of something else.
double overlap_of(const BentSurface& surface);

}  // namespace dynmesh
