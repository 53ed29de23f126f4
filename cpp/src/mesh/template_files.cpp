#include "mesh/template_files.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <dynmesh/template_mesh.hpp>
#include <limits>
#include <system_error>

#include "support/parse_number.hpp"

namespace dynmesh {
namespace {

constexpr std::string_view blanks = " \t\r\v\f";

/// Reads the next line, without the text that follows `comment`, and increments the line number.
bool next_line(std::istream& file, char comment, std::string& line, std::size_t& number) {
  if (!std::getline(file, line)) return false;
  line.resize(std::min(line.size(), line.find(comment)));
  ++number;
  return true;
}

template <class Integer>
bool parse(std::string_view word, Integer& value) {
  const auto [end, error] = parse_number(word.data(), word.data() + word.size(), value);
  return error == std::errc() && end == word.data() + word.size();
}

/// A vertex that a face refers to, counted from 1 as in OBJ, and the line of the face.
struct Reference {
  std::int64_t vertex = 0;
  std::size_t line = 0;
};

std::int64_t obj_corner(const std::string& path, std::size_t line, std::string_view word,
                        std::size_t vertices_so_far) {
  std::int64_t vertex = 0;
  const bool is_number = parse(word.substr(0, word.find('/')), vertex);
  if (vertex < 0) vertex += static_cast<std::int64_t>(vertices_so_far) + 1;
  if (!is_number || vertex < 1) {
    refuse_line(path, line,
                "has '" + std::string(word) + "' instead of a vertex index, counted from 1");
  }
  return vertex;
}

/// Refuses a face that repeats a vertex.
void check_distinct(const std::string& path, std::size_t line, std::vector<std::int64_t> face) {
  std::ranges::sort(face);
  const auto repeated = std::ranges::adjacent_find(face);
  if (repeated == face.end()) return;
  refuse_line(path, line,
              "has a face with vertex " + std::to_string(*repeated) + " twice; remove the face");
}

void check_corners(const std::string& path, std::size_t line, std::size_t corners) {
  if (corners >= 3) return;
  refuse_line(path, line, "has a face of " + std::to_string(corners) + " vertices");
}

/// Whether `word` is OFF or a variant of it, such as COFF or STOFF.
bool begins_off(std::string_view word) {
  if (!word.ends_with("OFF")) return false;
  word.remove_suffix(3);
  return word.find_first_not_of("CNST") == std::string_view::npos;
}

}  // namespace

void refuse_file(const std::string& path, const std::string& why) {
  throw UnreadableFile(path + ": " + why);
}

void refuse_line(const std::string& path, std::size_t line, const std::string& why) {
  refuse_file(path, "line " + std::to_string(line) + " " + why);
}

float checked_number(const std::string& path, std::size_t line, std::string_view word) {
  const std::string_view number = word.substr(word.starts_with('+') ? 1 : 0);
  double value = std::numeric_limits<double>::quiet_NaN();
  // It does not depend on the locale and accepts decimal numbers only.
  if (!parse(number, value) || !(std::abs(value) <= std::numeric_limits<float>::max())) {
    refuse_line(path, line,
                "has '" + std::string(word.substr(0, 80)) +
                    "' instead of a finite number; a template must be complete");
  }
  return static_cast<float>(value);
}

std::size_t checked_count(const std::string& path, std::size_t line, std::string_view word) {
  std::size_t count = 0;
  if (!parse(word, count)) {
    refuse_line(path, line, "has '" + std::string(word.substr(0, 80)) + "' instead of a count");
  }
  return count;
}

std::vector<std::string_view> words_of(std::string_view line) {
  std::vector<std::string_view> words;
  while (true) {
    line.remove_prefix(std::min(line.size(), line.find_first_not_of(blanks)));
    if (line.empty()) return words;
    words.push_back(line.substr(0, line.find_first_of(blanks)));
    line.remove_prefix(words.back().size());
  }
}

TemplateMesh read_obj(const std::string& path, std::istream& file) {
  TemplateMesh mesh;
  Reference largest;
  std::size_t number = 0;
  std::vector<std::int64_t> face;
  for (std::string line; next_line(file, '#', line, number);) {
    const auto words = words_of(line);
    if (words.empty()) continue;
    if (words[0] == "f") {
      face.clear();
      for (std::size_t c = 1; c < words.size(); ++c) {
        face.push_back(obj_corner(path, number, words[c], mesh.points().count));
        if (face.back() > largest.vertex) largest = {face.back(), number};
      }
      check_distinct(path, number, face);
      check_corners(path, number, face.size());
      for (std::int64_t& corner : face) --corner;  // OBJ counts from 1
      append_triangles(mesh, std::span<const std::int64_t>(face));
    } else if (words[0] == "v") {
      if (words.size() < 4) refuse_line(path, number, "has a vertex of less than 3 coordinates");
      for (std::size_t c = 1; c < 4; ++c) {
        mesh.vertices.push_back(checked_number(path, number, words[c]));
      }
    }
  }
  if (largest.vertex > static_cast<std::int64_t>(mesh.points().count)) {
    refuse_line(path, largest.line,
                "refers to vertex " + std::to_string(largest.vertex) + ", but there are " +
                    std::to_string(mesh.points().count));
  }
  return mesh;
}

TemplateMesh read_off(const std::string& path, std::istream& file) {
  TemplateMesh mesh;
  std::size_t number = 0;
  std::vector<std::size_t> counts;  // of vertices, faces and edges; the number of edges is not used
  std::size_t n_faces = 0;
  bool is_plain = true;  // no normals, colours or texture coordinates after the positions
  bool began = false;
  std::vector<std::size_t> face;
  for (std::string line; next_line(file, '#', line, number);) {
    auto words = words_of(line);
    std::span<const std::string_view> rest = words;
    if (!began && !rest.empty()) {
      began = true;
      if (begins_off(rest[0])) {
        is_plain = rest[0] == "OFF";
        rest = rest.subspan(1);
      }
    }
    if (rest.empty()) continue;
    if (counts.size() < 2) {
      if (std::ranges::find(rest, "BINARY") != rest.end()) {
        refuse_file(path, "binary OFF is not supported; convert it to text or to PLY");
      }
      for (const auto word : rest) counts.push_back(checked_count(path, number, word));
    } else if (mesh.points().count < counts[0]) {
      if (rest.size() < 3 || (is_plain && rest.size() > 3)) {
        refuse_line(path, number,
                    "has a vertex of " + std::to_string(rest.size()) + " coordinates");
      }
      for (const auto word : rest.first(3)) {
        mesh.vertices.push_back(checked_number(path, number, word));
      }
    } else if (n_faces < counts[1]) {
      const std::size_t corners = checked_count(path, number, rest[0]);
      check_corners(path, number, corners);
      if (corners > rest.size() - 1) {
        refuse_line(path, number,
                    "has a face of " + std::to_string(corners) + " vertices, but lists " +
                        std::to_string(rest.size() - 1));
      }
      face.clear();
      for (const auto word : rest.subspan(1, corners)) {
        face.push_back(checked_count(path, number, word));
        if (face.back() < counts[0]) continue;
        refuse_line(path, number,
                    "refers to vertex " + std::string(word) + ", but there are " +
                        std::to_string(counts[0]) + ", counted from 0");
      }
      append_triangles(mesh, std::span<const std::size_t>(face));
      ++n_faces;
    }
  }
  if (counts.size() < 2) refuse_file(path, "ends before the numbers of vertices and faces");
  if (mesh.points().count < counts[0] || n_faces < counts[1]) {
    refuse_file(path, "declares " + std::to_string(counts[0]) + " vertices and " +
                          std::to_string(counts[1]) + " faces, but ends after " +
                          std::to_string(mesh.points().count) + " and " + std::to_string(n_faces));
  }
  return mesh;
}

}  // namespace dynmesh
