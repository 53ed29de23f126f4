/// The PLY reader of template_files.hpp.
#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <iterator>
#include <limits>
#include <optional>
#include <sstream>
#include <type_traits>

#include "mesh/template_files.hpp"

namespace dynmesh {
namespace {

/// A numeric type: 'i' or 'u' for integers, 'f' for floating point, and its size in bytes.
struct Kind {
  char letter = 'i';
  std::size_t size = 0;
};

struct Property {
  std::string name;
  Kind kind;
  std::optional<Kind> count;  ///< of a list: the type of the count that precedes its elements
};

struct Element {
  std::string name;
  std::size_t count = 0;
  std::vector<Property> properties;
};

struct Header {
  std::string format;
  std::vector<Element> elements;
  std::size_t lines = 0;
};

std::optional<Kind> kind_of(std::string_view name) {
  struct Named {
    std::string_view old_name, new_name;
    Kind kind;
  };
  static constexpr std::array<Named, 8> kinds = {{{"char", "int8", {'i', 1}},
                                                  {"uchar", "uint8", {'u', 1}},
                                                  {"short", "int16", {'i', 2}},
                                                  {"ushort", "uint16", {'u', 2}},
                                                  {"int", "int32", {'i', 4}},
                                                  {"uint", "uint32", {'u', 4}},
                                                  {"float", "float32", {'f', 4}},
                                                  {"double", "float64", {'f', 8}}}};
  for (const Named& known : kinds) {
    if (name == known.old_name || name == known.new_name) return known.kind;
  }
  return std::nullopt;
}

Property property_of(const std::string& path, std::size_t line,
                     const std::vector<std::string_view>& words) {
  const bool is_list = words.size() == 5 && words[1] == "list";
  if (!is_list && words.size() != 3) refuse_line(path, line, "is not a valid property");
  const auto kind_at = [&](std::size_t word) {
    const auto kind = kind_of(words[word]);
    if (!kind)
      refuse_line(path, line, "has '" + std::string(words[word]) + "' as a type, which is unknown");
    return *kind;
  };
  if (!is_list) return {std::string(words[2]), kind_at(1), std::nullopt};
  if (kind_at(2).letter == 'f') refuse_line(path, line, "has a list whose count is not an integer");
  return {std::string(words[4]), kind_at(3), kind_at(2)};
}

Header read_header(const std::string& path, std::istream& file) {
  Header header;
  for (std::string line; std::getline(file, line);) {
    const std::size_t number = ++header.lines;
    const auto words = words_of(line);
    const std::string_view keyword = words.empty() ? "" : words[0];
    if (number == 1) {
      if (keyword != "ply" && keyword != "PLY") break;
    } else if (keyword == "end_header") {
      if (header.format.empty()) refuse_file(path, "has no line 'format' in its header");
      return header;
    } else if (keyword == "format" && words.size() > 1) {
      header.format = words[1];
      if (header.format != "ascii" && header.format != "binary_little_endian" &&
          header.format != "binary_big_endian") {
        refuse_line(path, number, "has the format '" + header.format + "', which is unknown");
      }
    } else if (keyword == "element" && words.size() == 3) {
      const auto same_name = [&](const Element& e) { return e.name == words[1]; };
      if (std::ranges::any_of(header.elements, same_name)) {
        refuse_line(path, number, "has the element '" + std::string(words[1]) + "' twice");
      }
      header.elements.push_back({std::string(words[1]), checked_count(path, number, words[2]), {}});
    } else if (keyword == "property" && !header.elements.empty()) {
      header.elements.back().properties.push_back(property_of(path, number, words));
    } else if (keyword != "comment" && keyword != "obj_info" && !words.empty()) {
      refuse_line(path, number, "does not belong in the header of a PLY file");
    }
  }
  if (header.lines < 2) refuse_file(path, "is not a PLY file: the first line must be 'ply'");
  refuse_file(path, "ends within its header");
}

/// Reads the numbers after the header one by one.
class Body {
 public:
  Body(const std::string& path, const Header& header, std::istream& file)
      : path_(path),
        is_text_(header.format == "ascii"),
        is_big_endian_(header.format == "binary_big_endian"),
        data_(std::istreambuf_iterator<char>(file), {}),
        rest_(data_),
        line_(header.lines + 1) {}
  Body(const Body&) = delete;
  Body& operator=(const Body&) = delete;

  void skip(Kind kind) { (void)next(kind); }

  /// Returns a coordinate. The caller checks whether it is finite.
  float coordinate(Kind kind) {
    const auto bytes = next(kind);  // before line_ is passed on, which it may increment
    if (is_text_) return checked_number(path_, line_, bytes);
    if (kind.letter != 'f')
      refuse_file(path_, "the coordinates of its vertices must be float or double");
    if (kind.size == sizeof(float)) return number<float>(bytes);
    const double value = number<double>(bytes);
    check_range(value);
    return static_cast<float>(value);
  }

  /// Returns an integer from 0 to 2^32 - 1.
  std::uint32_t count(Kind kind) {
    const auto bytes = next(kind);
    if (is_text_) {
      const std::size_t value = checked_count(path_, line_, bytes);
      if (value > UINT32_MAX) refuse_line(path_, line_, "has a number above 2^32 - 1");
      return static_cast<std::uint32_t>(value);
    }
    const auto highest = static_cast<signed char>(is_big_endian_ ? bytes.front() : bytes.back());
    const bool is_negative = kind.letter == 'i' && highest < 0;
    if (is_negative) refuse_file(path_, "has a negative vertex index or count in a list");
    return number<std::uint32_t>(bytes);
  }

 private:
  /// Returns the number stored in `bytes`. If it has fewer bytes than Number, the higher ones are
  /// zero.
  template <class Number>
  [[nodiscard]] Number number(std::string_view bytes) const {
    std::conditional_t<sizeof(Number) == 8, std::uint64_t, std::uint32_t> bits = 0;
    for (std::size_t i = 0; i < bytes.size(); ++i) {
      const auto byte =
          static_cast<unsigned char>(bytes[is_big_endian_ ? i : bytes.size() - 1 - i]);
      bits = bits << 8U | byte;
    }
    return std::bit_cast<Number>(bits);
  }

  void check_range(double coordinate) const {
    if (!std::isfinite(coordinate) || std::abs(coordinate) <= std::numeric_limits<float>::max()) {
      return;
    }
    std::ostringstream number;
    number << coordinate;
    refuse_file(path_, "has the coordinate " + number.str() + ", too large for a template");
  }

  /// Returns the bytes of the next number and moves past it.
  std::string_view next(Kind kind) {
    if (is_text_) skip_blanks();
    const std::size_t size =
        is_text_ ? std::min(rest_.size(), rest_.find_first_of(" \t\r\v\f\n")) : kind.size;
    if (rest_.empty() || rest_.size() < size) {
      refuse_file(path_, "ends before all declared elements");
    }
    const std::string_view found = rest_.substr(0, size);
    rest_.remove_prefix(size);
    return found;
  }

  void skip_blanks() {
    for (; !rest_.empty() && std::string_view(" \t\r\v\f\n").find(rest_[0]) != std::string::npos;
         rest_.remove_prefix(1)) {
      if (rest_[0] == '\n') ++line_;
    }
  }

  const std::string& path_;
  bool is_text_;
  bool is_big_endian_;
  std::string data_;
  std::string_view rest_;
  std::size_t line_;
};

bool is_corners(const Element& element, const Property& property) {
  return element.name == "face" && property.count &&
         (property.name == "vertex_indices" || property.name == "vertex_index");
}

/// Returns 0, 1 or 2 for x, y or z, or 3 for any other property.
std::size_t axis_of(const Element& element, const Property& property) {
  if (element.name != "vertex" || property.count || property.name.size() != 1) return 3;
  return std::min<std::size_t>(std::string_view("xyz").find(property.name), 3);
}

void check_element(const std::string& path, const Element& element) {
  if (element.count > 0 && element.properties.empty()) {
    refuse_file(path, "its element '" + element.name + "' has no properties");
  }
  std::array<int, 4> axes{};
  int corner_lists = 0;
  for (const Property& property : element.properties) {
    ++axes[axis_of(element, property)];
    if (!is_corners(element, property)) continue;
    ++corner_lists;
    if (property.kind.letter == 'f')
      refuse_file(path, "the vertices of its faces must be integers");
  }
  if (element.name == "vertex" && (axes[0] != 1 || axes[1] != 1 || axes[2] != 1)) {
    refuse_file(path, "its vertices need x, y and z, each once");
  }
  if (element.name == "face" && element.count > 0 && corner_lists != 1) {
    refuse_file(path, "its faces need one list 'vertex_indices'");
  }
}

}  // namespace

TemplateMesh read_ply(const std::string& path, std::istream& file) {
  const Header header = read_header(path, file);
  for (const Element& element : header.elements) check_element(path, element);
  Body body(path, header, file);
  TemplateMesh mesh;
  std::vector<std::uint32_t> face;
  for (const Element& element : header.elements) {
    for (std::size_t record = 0; record < element.count; ++record) {
      std::array<float, 3> position{};
      for (const Property& property : element.properties) {
        const std::uint32_t numbers = property.count ? body.count(*property.count) : 1;
        const std::size_t axis = axis_of(element, property);
        if (is_corners(element, property)) {
          face.clear();
          for (std::uint32_t c = 0; c < numbers; ++c) face.push_back(body.count(property.kind));
          if (numbers < 3) {
            refuse_file(path, "face " + std::to_string(record) + " has " + std::to_string(numbers) +
                                  " vertices");
          }
          append_triangles(mesh, std::span<const std::uint32_t>(face));
        } else if (axis < 3) {
          position[axis] = body.coordinate(property.kind);
        } else {
          for (std::uint32_t n = 0; n < numbers; ++n) body.skip(property.kind);
        }
      }
      if (element.name == "vertex") {
        mesh.vertices.insert(mesh.vertices.end(), position.begin(), position.end());
      }
    }
  }
  return mesh;
}

}  // namespace dynmesh
