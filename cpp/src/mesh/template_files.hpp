/// Mesh files, checked and written anew in the plainest form that their formats have.
///
/// OpenMesh's readers trust a file. They crash on a PLY whose header is out of order and never
/// return from one that is cut there; they make room for whatever count a file claims; they open
/// the material files that an OBJ names; a list among the vertices of a PLY shifts all that follows
/// it; and they turn what is no number into zeros or drop it: all without a word. So they are given
/// no file, but what is left of one after these checks: positions and triangles, nothing else.
#pragma once

#include <cstddef>
#include <istream>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace dynmesh {

struct PlainMesh {
  std::string text;  ///< in the format of the file
  std::size_t vertices = 0;
  std::size_t triangles = 0;
};

/// All of them throw UnreadableFile. What they hold in memory is a small
/// multiple of the size of the file, whatever it claims.
PlainMesh plain_obj(const std::string& path, std::istream& file);
PlainMesh plain_off(const std::string& path, std::istream& file);
PlainMesh plain_ply(const std::string& path, std::istream& file);

[[noreturn]] void refuse_file(const std::string& path, const std::string& why);
/// `line` counts from 1.
[[noreturn]] void refuse_line(const std::string& path, std::size_t line, const std::string& why);

/// `word`, a finite number that a float holds, as all readers understand it; refuses others.
std::string_view checked_number(const std::string& path, std::size_t line, std::string_view word);
/// A whole number from 0 on; refuses others.
std::size_t checked_count(const std::string& path, std::size_t line, std::string_view word);

/// The words of a line.
std::vector<std::string_view> words_of(std::string_view line);

/// Calls `take(a, b, c)` for each triangle of a polygon, fanned from its first vertex.
template <class Corner, class Take>
void for_each_triangle(std::span<const Corner> polygon, const Take& take) {
  for (std::size_t c = 2; c < polygon.size(); ++c) take(polygon[0], polygon[c - 1], polygon[c]);
}

}  // namespace dynmesh
