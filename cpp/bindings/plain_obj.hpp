/// Reads the text of an OBJ file fast, if it is written in the ordinary way.
#pragma once

#include <cstdint>
#include <optional>
#include <string_view>
#include <vector>

namespace dynmesh {

/// The vertices and faces of an OBJ file.
struct PlainObj {
  std::vector<double> positions;      ///< x y z of every vertex
  std::vector<std::int64_t> sizes;    ///< how many corners each face has
  std::vector<std::int64_t> corners;  ///< of all faces, counted from 0
};

/// Reads the text; nothing where any line is written in an unusual way or is wrong. The reader in
/// Python, which reads line by line, then decides what is meant and says what is wrong. What is
/// returned is exactly what that reader would return.
std::optional<PlainObj> read_plain_obj(std::string_view text);

}  // namespace dynmesh
