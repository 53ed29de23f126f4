/// Which part of a surface was measured.
#pragma once

#include <cstdint>
#include <dynmesh/topology.hpp>
#include <dynmesh/types.hpp>
#include <span>
#include <vector>

#include "surface_fit/point_scan.hpp"

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

struct Coverage {
  /// The share of the template's area that is the largest connected piece without a point, of what
  /// the sensors should see: a limb that was not measured, and may lie anywhere. 1 if they should
  /// see nothing.
  double hole = 1;
  /// The share of the template's area where another part lies as well and faces the same way. No
  /// surface does: something that was not measured was drawn to the points of something else.
  double overlap = 0;
};

Coverage coverage_of(const BentSurface& surface, const PointScan& scan);

/// (k,) the area around each vertex: a third of its triangles.
std::vector<double> areas_of(std::span<const Triangle> faces, Field x);

/// The area of the largest connected piece of the vertices (k,) that are marked.
double largest_piece(const Cells& cells, std::span<const double> areas,
                     std::vector<std::uint8_t> is_in);

/// (k,) the vertices that some viewpoint should see, since they face it and nothing lies before
/// them; all without viewpoints.
std::vector<std::uint8_t> find_seen(const BentSurface& surface, Field viewpoints);

}  // namespace dynmesh
