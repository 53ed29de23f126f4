/// Faces that a caller gives.
#pragma once

#include <cstddef>
#include <dynmesh/topology.hpp>
#include <dynmesh/types.hpp>
#include <vector>

#include "base/checks.hpp"

namespace dynmesh {

inline std::vector<Triangle> triangles_of(Faces faces) {
  std::vector<Triangle> triangles;
  for (std::size_t f = 0; f < faces.count; ++f) triangles.push_back(faces[f]);
  return triangles;
}

inline Topology checked_topology(Faces faces, std::size_t n_vertices) {
  if (faces.count == 0) refuse("faces", "is empty; completion needs the connectivity of the mesh");
  return build_topology(faces, n_vertices);
}

}  // namespace dynmesh
