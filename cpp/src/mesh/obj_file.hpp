/// The parser of OBJ files.
#pragma once

#include <string_view>
#include <vector>

#include "mesh/polygon_mesh.hpp"

namespace dynmesh {

/// The content of an OBJ file. Statements and comments are parts of its text, so their order and
/// their lines follow from where they are. They are as in the file, with "\" where a statement
/// continues on the next line.
struct ObjFile {
  PolygonMesh mesh;
  std::vector<std::string_view> vertices;  ///< the statement of each vertex; may contain a colour
  std::vector<std::string_view> faces;     ///< the statement of each face, with texture and normals
  std::vector<std::string_view> others;    ///< such as texture coordinates, groups and materials
  std::vector<std::string_view> comments;  ///< at the beginning of the file, without the "#"
};

/// Parses the text of an OBJ file. Positions may be NaN or infinite. A face may have a vertex
/// several times, and vertices that follow it. A vertex may have a weight of 1 or a colour. Throws
/// MalformedFile if a vertex or face is invalid. Takes linear time, and memory of a small multiple
/// of the size of the text.
ObjFile parse_obj(std::string_view text);

}  // namespace dynmesh
