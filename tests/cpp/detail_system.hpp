/// The linear system of method detail, for tests and benchmarks of its factorisation.
#pragma once

#include <dynmesh/topology.hpp>
#include <vector>

#include "detail/detail_operator.hpp"
#include "meshes.hpp"

namespace dynmesh::testing {

/// N = K^T K of the mesh.
inline SymmetricMatrix system_of(const Mesh<double>& mesh) {
  const Topology topology = build_topology(mesh.faces(), mesh.size());
  std::vector<Vector3<double>> frame(mesh.size());
  for (std::size_t v = 0; v < frame.size(); ++v) {
    frame[v] = {mesh.vertices[3 * v], mesh.vertices[3 * v + 1], mesh.vertices[3 * v + 2]};
  }
  std::vector<Triangle> faces;
  for (std::size_t f = 0; f < mesh.faces().count; ++f) faces.push_back(mesh.faces()[f]);
  return normal_matrix(build_detail_operator(faces, topology.cells, frame));
}

}  // namespace dynmesh::testing
