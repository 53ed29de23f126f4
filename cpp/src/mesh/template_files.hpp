/// The readers of template files, one for each format.
///
/// The readers of OpenMesh are not used, since they do not validate files. They crash on a PLY file
/// whose header is out of order and do not return if the header is truncated. They allocate memory
/// for any count that a file declares. They open the material files that an OBJ file names. A list
/// property of the vertices of a PLY file shifts all data that follows it. Text that is not a
/// number becomes zero or is dropped without an error.
#pragma once

#include <cstddef>
#include <dynmesh/template_mesh.hpp>
#include <dynmesh/types.hpp>
#include <istream>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace dynmesh {

/// These functions throw UnreadableFile. The memory they use is a small multiple of the size of the
/// file, whatever counts it declares. `read_ply` does not check whether faces refer to existing
/// vertices and whether coordinates are finite; the caller does.
TemplateMesh read_obj(const std::string& path, std::istream& file);
TemplateMesh read_off(const std::string& path, std::istream& file);
TemplateMesh read_ply(const std::string& path, std::istream& file);

[[noreturn]] void refuse_file(const std::string& path, const std::string& why);
/// `line` counts from 1.
[[noreturn]] void refuse_line(const std::string& path, std::size_t line, const std::string& why);

/// Returns the value of `word`. Refuses it unless it is a finite number within the range of float.
float checked_number(const std::string& path, std::size_t line, std::string_view word);
/// Returns the value of `word`. Refuses it unless it is a non-negative integer.
std::size_t checked_count(const std::string& path, std::size_t line, std::string_view word);

/// Splits a line into words.
std::vector<std::string_view> words_of(std::string_view line);

/// Adds a polygon, split into a fan of triangles from its first vertex.
template <class Corner>
void append_triangles(TemplateMesh& mesh, std::span<const Corner> polygon) {
  for (std::size_t c = 2; c < polygon.size(); ++c) {
    for (const Corner corner : {polygon[0], polygon[c - 1], polygon[c]}) {
      mesh.faces.push_back(static_cast<Index>(corner));
    }
  }
}

}  // namespace dynmesh
