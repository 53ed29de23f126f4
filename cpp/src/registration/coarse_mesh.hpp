/// A coarse mesh of a template, on which large motions are found.
#pragma once

#include <dynmesh/topology.hpp>
#include <dynmesh/types.hpp>
#include <span>
#include <vector>

#include "kernels/rotation_kernels.hpp"

namespace dynmesh {

/// Its vertices are those of the template at the centres of clusters, and its triangles are where
/// three clusters meet. Clusters that touch without a triangle are joined by faces with a repeated
/// vertex.
struct CoarseMesh {
  std::vector<Index> of_vertex;  ///< (k,) the vertex of the coarse mesh that is nearest along edges
  std::vector<Triangle> faces;
  std::vector<Vector3> positions;
  Topology topology;

  /// The positions of the template's vertices, which follow those of the coarse mesh and its
  /// rotations; `frame` is the template.
  [[nodiscard]] std::vector<Vector3> lifted(Field frame, Field x,
                                            std::span<const Quaternion> rotations) const;
};

/// A template of at most `most_vertices` is its own coarse mesh.
CoarseMesh coarse_mesh_of(std::span<const Triangle> faces, Field frame, std::size_t most_vertices);

}  // namespace dynmesh
