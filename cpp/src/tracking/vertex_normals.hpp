/// The normals of a surface at its vertices.
#pragma once

#include <dynmesh/types.hpp>
#include <span>
#include <vector>

namespace dynmesh {

/// Sets `normals` (k,) to the mean of the normals of the faces around each vertex, weighted by
/// area, of unit length; 0 where that is not defined.
void find_vertex_normals(std::span<const Triangle> faces, std::span<const Vector3<double>> frame,
                         std::span<Vector3<double>> normals);

}  // namespace dynmesh
