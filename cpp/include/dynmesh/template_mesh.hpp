/// Reads a template, the complete first frame of a dynamic mesh, from a mesh file.
#pragma once

#include <dynmesh/export.hpp>
#include <dynmesh/types.hpp>
#include <stdexcept>
#include <string>
#include <vector>

namespace dynmesh {

/// Thrown if a mesh file cannot be read. The message contains the path and, if it is known, the
/// line.
class DYNMESH_EXPORT UnreadableFile : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

struct TemplateMesh {
  std::vector<float> vertices;  ///< x, y, z of each of the k vertices, in the order of the file
  std::vector<Index>
      faces;  ///< three vertices per face; polygons are split into a fan from their first vertex

  [[nodiscard]] Points<const float> points() const {
    return {vertices.data(), vertices.size() / 3};
  }
  [[nodiscard]] Faces triangles() const { return {faces.data(), faces.size() / 3}; }
};

/// Reads an OBJ or PLY file, according to its suffix. `path` is UTF-8, on Windows as well. No
/// vertex or face is dropped, merged or renumbered. Throws UnreadableFile if the file cannot be
/// read completely.
DYNMESH_EXPORT TemplateMesh read_template(const std::string& path);

/// Reads the positions alone, x, y, z of each vertex, of a frame in which some may be NaN or
/// infinite, but none finite and beyond the range of float. Apart from that as `read_template`.
DYNMESH_EXPORT std::vector<float> read_positions(const std::string& path);

}  // namespace dynmesh
