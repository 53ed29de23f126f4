/// The parser of OBJ files.
#pragma once

#include <cstdint>
#include <string_view>
#include <vector>

namespace dynmesh {

struct PolygonMesh {
  std::vector<double> positions;      ///< x y z of every vertex, in the order of the file
  std::vector<std::int64_t> sizes;    ///< the number of corners of each face, at least 3
  std::vector<std::int64_t> corners;  ///< the vertices of all corners, counted from 0
};

/// The content of an OBJ file, as far as it is used.
struct ObjFile {
  PolygonMesh mesh;
  std::vector<std::string_view> comments;  ///< at the beginning of the file, without the "#"
};

/// Parses the text of an OBJ file. Positions may be NaN or infinite. A face may have a vertex
/// several times, and vertices that follow it. A vertex may have a weight of 1 or a colour. Throws
/// MalformedFile if a vertex or face is invalid. Takes linear time, and memory of a small multiple
/// of the size of the text.
ObjFile parse_obj(std::string_view text);

/// Parses the text of an OFF file or of a variant such as COFF, whose normals, colours and texture
/// coordinates are skipped. Positions may be NaN or infinite. Throws MalformedFile if the text is
/// invalid. Takes linear time, and memory of a small multiple of the size of the text.
PolygonMesh parse_off(std::string_view text);

}  // namespace dynmesh
