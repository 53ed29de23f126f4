/// A mesh with fewer of the vertices of a mesh.
#pragma once

#include <cstddef>
#include <dynmesh/topology.hpp>
#include <dynmesh/types.hpp>
#include <span>
#include <vector>

namespace dynmesh {

struct DecimatedMesh {
  std::vector<Index> vertices;  ///< those of the mesh, ascending
  std::vector<Triangle> faces;  ///< of their places in this list
};

/// Moves vertices onto neighbours, one after the other, until at most `most_vertices` are left:
/// those first that change the surface and the lengths of its edges least (Garland and Heckbert
/// 1997). Keeps at least `fewest` vertices of each component, boundaries, and what is not a
/// manifold, and turns no triangle over. Which vertices are left does not depend on their numbers.
DecimatedMesh decimated(std::span<const Triangle> faces, const Topology& topology, Field frame,
                        std::size_t most_vertices, std::size_t fewest);

}  // namespace dynmesh
