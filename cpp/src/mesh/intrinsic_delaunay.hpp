/// The intrinsic Delaunay triangulation of a surface.
#pragma once

#include <array>
#include <cstddef>
#include <dynmesh/types.hpp>
#include <span>
#include <vector>

namespace dynmesh {

/// A triangle that is defined by its side lengths alone. Its edges are geodesics of the surface,
/// not straight lines in space. Two vertices may be connected by several edges, and a vertex by an
/// edge to itself.
struct IntrinsicTriangle {
  Triangle vertices;
  std::array<double, 3> lengths;  ///< of the side from vertex s to vertex s + 1

  [[nodiscard]] double area() const;
  /// The cotangent of the angle opposite to side s.
  [[nodiscard]] double cotangent(std::size_t side) const;
};

/// Returns the intrinsic Delaunay triangulation of a surface. It has the same vertices and the same
/// surface with other edges, so cotangents do not depend on how the surface was triangulated.
///
/// Flips edges until the two angles opposite to each edge add up to at most pi (Fisher, Springborn,
/// Bobenko and Schroeder 2006). Edges with one triangle, with more than two, or with two of
/// opposite orientation are not flipped. Lengths are in units of `unit`, and all of them are
/// increased by the smallest amount for which no triangle is degenerate (Sharp and Crane 2020).
/// Faces with a repeated vertex are omitted.
std::vector<IntrinsicTriangle> intrinsic_delaunay(std::span<const Triangle> faces, Field frame,
                                                  double unit);

}  // namespace dynmesh
