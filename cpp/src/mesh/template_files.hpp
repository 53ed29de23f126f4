/// The readers of template files, one for each format.
///
/// OpenMesh has readers of its own, but they trust a file. They crash on a PLY whose header is out
/// of order and never return from one that is cut there; they make room for whatever count a file
/// claims; they open the material files that an OBJ names; a list among the vertices of a PLY
/// shifts all that follows it; and they turn what is not a number into zeros or drop it without a
/// word.
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

/// All of them throw UnreadableFile. What they hold in memory is a small multiple of the size of
/// the file, whatever it claims. Whether faces of a PLY refer to vertices that exist, and whether
/// its numbers are finite, is left to the caller.
TemplateMesh read_obj(const std::string& path, std::istream& file);
TemplateMesh read_off(const std::string& path, std::istream& file);
TemplateMesh read_ply(const std::string& path, std::istream& file);

[[noreturn]] void refuse_file(const std::string& path, const std::string& why);
/// `line` counts from 1.
[[noreturn]] void refuse_line(const std::string& path, std::size_t line, const std::string& why);

/// The value of `word`, a finite number that a float holds; refuses others.
float checked_number(const std::string& path, std::size_t line, std::string_view word);
/// A whole number from 0 on; refuses others.
std::size_t checked_count(const std::string& path, std::size_t line, std::string_view word);

/// The words of a line.
std::vector<std::string_view> words_of(std::string_view line);

/// Adds a polygon, fanned from its first vertex.
template <class Corner>
void append_triangles(TemplateMesh& mesh, std::span<const Corner> polygon) {
  for (std::size_t c = 2; c < polygon.size(); ++c) {
    for (const Corner corner : {polygon[0], polygon[c - 1], polygon[c]}) {
      mesh.faces.push_back(static_cast<Index>(corner));
    }
  }
}

}  // namespace dynmesh
