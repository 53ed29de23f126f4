/// The parsers of OBJ and PLY files.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <variant>
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
  /// Which of these keywords begin a line: "vt", "vn", "usemtl", "g" and "o".
  std::vector<std::string_view> further;
  bool has_colours = false;  ///< whether a vertex has one
};

/// Parses the text of an OBJ file. Positions may be NaN or infinite. A face may have a vertex
/// several times, and vertices that follow it. A vertex may have a weight of 1 or a colour. Throws
/// MalformedFile if a vertex or face is invalid. Takes linear time, and memory of a small multiple
/// of the size of the text.
ObjFile parse_obj(std::string_view text);

/// Numbers of one of the types of PLY, in the byte order of the processor.
using PlyNumbers =
    std::variant<std::vector<std::int8_t>, std::vector<std::uint8_t>, std::vector<std::int16_t>,
                 std::vector<std::uint16_t>, std::vector<std::int32_t>, std::vector<std::uint32_t>,
                 std::vector<float>, std::vector<double>>;

/// A number, or a list of numbers, in each record of an element.
struct PlyProperty {
  std::string name;
  PlyNumbers values;                 ///< of all records, one after another
  std::optional<PlyNumbers> counts;  ///< of a list: how many values each record has
};

/// Records of one kind, such as all vertices.
struct PlyElement {
  std::string name;
  std::size_t n_records = 0;
  std::vector<PlyProperty> properties;  ///< with different names, in the order of the file
};

/// The content of a PLY file. Names and comments are in the encoding of the file.
struct PlyFile {
  std::vector<PlyElement> elements;   ///< with different names, in the order of the file
  std::vector<std::string> comments;  ///< of the header, with single spaces between the words
};

/// Returns the element or property of this name, or null.
template <class Named>
const Named* find_named(const std::vector<Named>& all, std::string_view name) {
  const auto found = std::ranges::find(all, name, &Named::name);
  return found == all.end() ? nullptr : &*found;
}

/// Parses a PLY file in text or in either byte order. Numbers may be NaN or infinite. Elements and
/// properties are not interpreted. Throws MalformedFile if anything is invalid or missing, or
/// follows the last element. Takes linear time, and memory of a small multiple of the size of
/// `data`, whatever counts it declares.
PlyFile parse_ply(std::string_view data);

}  // namespace dynmesh
