/// The intrinsic Delaunay triangulation of a surface: the same vertices and the same surface, other
/// edges, so that cotangents do not depend on how it happened to be cut into triangles.
#pragma once

#include <array>
#include <dynmesh/topology.hpp>
#include <dynmesh/types.hpp>
#include <span>
#include <vector>

namespace dynmesh {

using Triangle = std::array<Index, 3>;

/// Known by its side lengths alone; its edges run over the surface and not through space. Two
/// vertices may share several edges, and a vertex one with itself.
struct IntrinsicTriangle {
  Triangle vertices;
  std::array<double, 3> lengths;  ///< of the sides from vertex s to vertex s + 1

  [[nodiscard]] double area() const;
  /// Of the angle opposite to side s.
  [[nodiscard]] double cotangent(std::size_t side) const;
};

/// Flips edges until no two angles opposite to one exceed two right ones (Fisher, Springborn,
/// Bobenko and Schroeder 2006). Edges with one triangle, more than two, or two that face opposite
/// ways stay. Lengths are in units of `unit`, and all made longer by just so much that no triangle
/// is degenerate (Sharp and Crane 2020). Faces with a repeated vertex are left out.
template <class Real>
std::vector<IntrinsicTriangle> intrinsic_delaunay(std::span<const Triangle> faces,
                                                  std::span<const Vector3<Real>> frame,
                                                  double unit);

}  // namespace dynmesh
