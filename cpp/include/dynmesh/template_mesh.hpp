/// Reading a template, the complete first frame of a dynamic mesh, from a mesh file.
#pragma once

#include <dynmesh/export.hpp>
#include <dynmesh/types.hpp>
#include <stdexcept>
#include <string>
#include <vector>

namespace dynmesh {

/// A mesh file that cannot be read; the message names it, and where it is known, the line.
class DYNMESH_EXPORT UnreadableFile : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

struct TemplateMesh {
  std::vector<float> vertices;  ///< k rows x, y, z, in the order of the file
  std::vector<Index> faces;     ///< rows of three; polygons are fanned from their first vertex

  [[nodiscard]] Points<const float> points() const {
    return {vertices.data(), vertices.size() / 3};
  }
  [[nodiscard]] Faces triangles() const { return {faces.data(), faces.size() / 3}; }
};

/// Reads OBJ, PLY or OFF, by suffix. No vertex or face is dropped, merged or renumbered. Throws
/// UnreadableFile where it cannot be read as a whole.
DYNMESH_EXPORT TemplateMesh read_template(const std::string& path);

}  // namespace dynmesh
