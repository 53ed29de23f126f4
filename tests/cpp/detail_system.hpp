/// The linear system of method detail, for tests and benchmarks of its factorisation.
#pragma once

#include <dynmesh/topology.hpp>

#include "meshes.hpp"
#include "shape/detail_operator.hpp"

namespace dynmesh::testing {

/// N = K^T K of the mesh.
inline SparseMatrix system_of(const Mesh<double>& mesh) {
  const Topology topology = build_topology(mesh.faces(), mesh.size());
  return normal_matrix(
      build_detail_operator(triangles_of(mesh), topology.cells, rows_of(mesh.vertices)));
}

}  // namespace dynmesh::testing
