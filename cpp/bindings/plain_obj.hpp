/// A fast reader of OBJ files that use only the common syntax.
#pragma once

#include <cstdint>
#include <optional>
#include <string_view>
#include <vector>

namespace dynmesh {

/// The vertices and faces of an OBJ file.
struct PlainObj {
  std::vector<double> positions;      ///< x y z of every vertex
  std::vector<std::int64_t> sizes;    ///< the number of corners of each face
  std::vector<std::int64_t> corners;  ///< the vertex indices of all corners, counted from 0
};

/// Reads the text of an OBJ file. Returns nothing if a line is invalid or uses other syntax; the
/// reader in Python, which is slower, then reads the file or reports the error. Both readers return
/// the same result.
std::optional<PlainObj> read_plain_obj(std::string_view text);

}  // namespace dynmesh
