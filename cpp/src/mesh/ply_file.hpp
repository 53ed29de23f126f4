/// The parser of PLY files.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <variant>
#include <vector>

namespace dynmesh {

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

  /// Returns the property of this name, or null.
  [[nodiscard]] const PlyProperty* find(std::string_view property) const;
};

/// The content of a PLY file. Names and comments are in the encoding of the file.
struct PlyFile {
  std::vector<PlyElement> elements;   ///< with different names, in the order of the file
  std::vector<std::string> comments;  ///< of the header, with single spaces between the words

  /// Returns the element of this name, or null.
  [[nodiscard]] const PlyElement* find(std::string_view element) const;
};

/// Parses a PLY file in text or in either byte order. Numbers may be NaN or infinite. Elements and
/// properties are not interpreted. Throws MalformedFile if anything is invalid or missing, or
/// follows the last element. Takes linear time, and memory of a small multiple of the size of
/// `data`, whatever counts it declares.
PlyFile parse_ply(std::string_view data);

}  // namespace dynmesh
