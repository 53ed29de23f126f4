/// A mesh with fewer of the vertices of a mesh.
#pragma once

#include <cstddef>
#include <cstdint>
#include <dynmesh/topology.hpp>
#include <dynmesh/types.hpp>
#include <span>
#include <vector>

namespace dynmesh {

struct DecimatedMesh {
  std::vector<Index> vertices;  ///< those of the mesh, ascending
  std::vector<Triangle> faces;  ///< of their places in this list
};

/// How many vertices are left at most of each group of components, and at least of each component.
struct DecimationLimits {
  std::vector<std::size_t> most;       ///< (groups,)
  std::size_t fewest = 0;              ///< of a component
  std::vector<std::uint8_t> group_of;  ///< (components,) empty if there is one group
};

/// Moves vertices onto neighbours, one after the other, until no more than wanted are left: those
/// first that change the surface and the lengths of its edges least (Garland and Heckbert 1997).
/// Keeps boundaries and what is not a manifold, and turns no triangle over. Which vertices are left
/// does not depend on their numbers.
DecimatedMesh decimated(std::span<const Triangle> faces, const Topology& topology, Field frame,
                        const DecimationLimits& limits);

}  // namespace dynmesh
