/// Reading a template, the complete first frame of a dynamic mesh, from a mesh file.
#pragma once

#include <dynmesh/export.hpp>
#include <dynmesh/types.hpp>
#include <string>
#include <vector>

namespace dynmesh {

struct TemplateMesh {
  std::vector<float> vertices;  ///< k rows x, y, z, in the order of the file
  std::vector<Index> faces;     ///< rows of three; polygons are fanned from their first vertex

  [[nodiscard]] Points<const float> points() const {
    return {vertices.data(), vertices.size() / 3};
  }
  [[nodiscard]] Faces triangles() const { return {faces.data(), faces.size() / 3}; }
};

/// Reads OBJ, PLY or OFF, by suffix, through OpenMesh's readers. No vertex or face is dropped,
/// merged or renumbered. Throws std::runtime_error that names the file where it cannot be read, and
/// where the readers lost vertices on the way, as they do with positions that are not numbers.
DYNMESH_EXPORT TemplateMesh read_template(const std::string& path);

}  // namespace dynmesh
