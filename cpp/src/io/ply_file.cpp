#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstring>
#include <limits>
#include <type_traits>

#include "io/mesh_files.hpp"
#include "io/mesh_text.hpp"

namespace dynmesh {
namespace {

struct Type {
  std::string_view old_name, new_name;
  PlyNumbers none;
};

/// In the order of PlyNumbers.
const std::array<Type, 8>& types() {
  static const std::array<Type, 8> all = {{{"char", "int8", std::vector<std::int8_t>{}},
                                           {"uchar", "uint8", std::vector<std::uint8_t>{}},
                                           {"short", "int16", std::vector<std::int16_t>{}},
                                           {"ushort", "uint16", std::vector<std::uint16_t>{}},
                                           {"int", "int32", std::vector<std::int32_t>{}},
                                           {"uint", "uint32", std::vector<std::uint32_t>{}},
                                           {"float", "float32", std::vector<float>{}},
                                           {"double", "float64", std::vector<double>{}}}};
  return all;
}

template <class T>
std::string type_name() {
  return std::string(types()[PlyNumbers(std::vector<T>()).index()].old_name);
}

std::string record_of(const PlyElement& element, std::size_t record) {
  return "record " + std::to_string(record) + " of " + quoted(element.name) + ", of " +
         std::to_string(element.n_records);
}

enum class Format { text, little_endian, big_endian };

/// Parses the header. Its line ends are those of its first line, as the data that follows may begin
/// with any byte.
class Header {
 public:
  std::optional<Format> format;
  PlyFile file;           ///< the elements, without values, and the comments
  std::string_view rest;  ///< the data after the header

  explicit Header(std::string_view data) : data_(data) {
    rest = without_byte_order_mark(data);
    const std::string_view newline = rest.starts_with("ply\r\n") ? "\r\n"
                                     : rest.starts_with("ply\n") ? "\n"
                                                                 : "\r";
    if (!rest.starts_with("ply") || !rest.substr(3).starts_with(newline)) {
      throw MalformedFile("is not a PLY file: line 1 is not 'ply'");
    }
    rest.remove_prefix(3 + newline.size());
    while (true) {
      const std::size_t length = rest.find(newline);
      if (length == std::string_view::npos) {
        throw MalformedFile("its header is cut or damaged: it has no line 'end_header'");
      }
      line_ = rest.substr(0, length);
      rest.remove_prefix(length + newline.size());
      if (line_ == "end_header") break;
      add_line();
    }
    if (!format) throw MalformedFile("its header names no format");
  }

 private:
  void add_line() {
    std::vector<std::string_view> words;
    if (!add_words(line_, words)) return;
    const std::string_view keyword = words[0];
    if (keyword == "comment" || keyword == "obj_info") {
      std::string& comment = file.comments.emplace_back();
      for (std::size_t w = 1; w < words.size(); ++w) {
        comment.append(w > 1 ? " " : "").append(words[w]);
      }
    } else if (keyword == "format" && words.size() == 3 && words[2] == "1.0" && !format) {
      format = format_of(words[1]);
    } else if (keyword == "element" && words.size() == 3 && format) {
      refuse_second("element", words[1], file.elements);
      const std::optional<std::size_t> count = count_in(words[2]);
      if (!count) refuse("the number of records must be an integer, not " + quoted(words[2]));
      file.elements.push_back({std::string(words[1]), *count, {}});
    } else if (keyword == "property" && words.size() > 1 && !file.elements.empty()) {
      refuse_second("property", words.back(), file.elements.back().properties);
      file.elements.back().properties.push_back(property_of(words));
    } else {
      refuse(quoted(line_) + " is not valid here");
    }
  }

  [[nodiscard]] Format format_of(std::string_view name) const {
    if (name == "ascii") return Format::text;
    if (name == "binary_little_endian") return Format::little_endian;
    if (name == "binary_big_endian") return Format::big_endian;
    refuse("the format must be one of ascii, binary_little_endian, binary_big_endian, not " +
           quoted(name));
  }

  [[nodiscard]] PlyProperty property_of(const std::vector<std::string_view>& words) const {
    std::string name(words.back());
    if (words.size() == 3) return {std::move(name), type_of(words[1]).none, std::nullopt};
    if (words.size() != 5 || words[1] != "list") {
      refuse("a property needs a type, or 'list' and two types, and a name");
    }
    const Type& count = type_of(words[2]);
    if (count.old_name == "float" || count.old_name == "double") {
      refuse("the length of a list must be an integer type, not " + quoted(words[2]));
    }
    return {std::move(name), type_of(words[3]).none, count.none};
  }

  [[nodiscard]] const Type& type_of(std::string_view name) const {
    const auto has_name = [&](const Type& t) { return name == t.old_name || name == t.new_name; };
    const auto found = std::ranges::find_if(types(), has_name);
    if (found == types().end()) refuse("unknown type " + quoted(name));
    return *found;
  }

  template <class Named>
  void refuse_second(const char* what, std::string_view name,
                     const std::vector<Named>& others) const {
    if (find_named(others, name)) {
      refuse(std::string("there is a second ") + what + " " + quoted(name));
    }
  }

  [[noreturn]] void refuse(const std::string& why) const { refuse_line(data_, line_, why); }

  std::string_view data_;
  std::string_view line_;
};

/// Reads text after the header: a line for each record, a word for each number, and empty lines.
class Text {
 public:
  Text(std::string_view data, std::string_view rest) : data_(data), lines_(rest) {}

  void begin_record(const PlyElement& element, std::size_t record) {
    element_ = &element;
    words_.clear();
    while (words_.empty()) {
      if (!lines_.next()) {
        throw MalformedFile("is cut or damaged: ends before " + record_of(element, record));
      }
      add_words(lines_.line(), words_);
    }
    n_read_ = 0;
  }

  template <class T>
  void append(std::size_t n, std::vector<T>& values) {
    for (; n > 0; --n) {
      if (n_read_ == words_.size()) {
        refuse("has too few words for a record of " + quoted(element_->name));
      }
      values.push_back(value_of<T>(words_[n_read_++]));
    }
  }

  void end_record() {
    if (n_read_ == words_.size()) return;
    refuse("has more words than a record of " + quoted(element_->name) + ", from " +
           quoted(words_[n_read_]));
  }

  void end() {
    while (lines_.next()) {
      if (add_words(lines_.line(), words_)) refuse("continues after its last element");
    }
  }

  [[noreturn]] void refuse(const std::string& why) const { refuse_line(data_, lines_.line(), why); }

 private:
  template <class T>
  [[nodiscard]] T value_of(std::string_view word) const {
    const std::optional<double> number = number_in(word);
    if constexpr (std::is_floating_point_v<T>) {
      const auto value = static_cast<T>(number.value_or(0));
      if (number && std::isinf(value) == std::isinf(*number)) return value;
    } else if (number && *number >= std::numeric_limits<T>::lowest() &&
               *number <= std::numeric_limits<T>::max() && *number == std::trunc(*number)) {
      return static_cast<T>(*number);
    }
    refuse(quoted(word) + " is not a value of type " + type_name<T>());
  }

  std::string_view data_;
  Lines lines_;
  std::vector<std::string_view> words_;  // of the line
  std::size_t n_read_ = 0;
  const PlyElement* element_ = nullptr;
};

/// Reads binary data after the header.
class Binary {
 public:
  Binary(std::string_view data, std::string_view rest, bool is_big_endian)
      : data_(data), rest_(rest), is_swapped_(is_big_endian) {}  // processors are little-endian

  void begin_record(const PlyElement& element, std::size_t record) {
    element_ = &element;
    record_ = record;
  }

  template <class T>
  void append(std::size_t n, std::vector<T>& values) {
    if (n > rest_.size() / sizeof(T)) {
      refuse("needs " + std::to_string(n) + " numbers of type " + type_name<T>() + " at byte " +
             std::to_string(data_.size() - rest_.size()) + ", but the file ends at byte " +
             std::to_string(data_.size()));
    }
    const std::size_t before = values.size();
    values.resize(before + n);
    if (n > 0) std::memcpy(&values[before], rest_.data(), n * sizeof(T));
    rest_.remove_prefix(n * sizeof(T));
    if (!is_swapped_) return;
    for (std::size_t i = before; i < values.size(); ++i) {
      auto bytes = std::bit_cast<std::array<std::byte, sizeof(T)>>(values[i]);
      std::ranges::reverse(bytes);
      values[i] = std::bit_cast<T>(bytes);
    }
  }

  void end_record() const {}

  void end() const {
    if (rest_.empty()) return;
    throw MalformedFile("continues for " + std::to_string(rest_.size()) +
                        " bytes after its last element");
  }

  [[noreturn]] void refuse(const std::string& why) const {
    throw MalformedFile("is cut or damaged: " + record_of(*element_, record_) + ", " + why);
  }

 private:
  std::string_view data_;
  std::string_view rest_;
  bool is_swapped_;
  const PlyElement* element_ = nullptr;
  std::size_t record_ = 0;
};

/// Reads the values of all elements. Reserves no memory for the declared number of records, which
/// may be wrong.
template <class Source>
void read_elements(Source source, PlyFile& file) {
  for (PlyElement& element : file.elements) {
    if (element.n_records > 0 && element.properties.empty()) {
      throw MalformedFile("its element " + quoted(element.name) + " has no properties");
    }
    for (std::size_t record = 0; record < element.n_records; ++record) {
      source.begin_record(element, record);
      for (PlyProperty& property : element.properties) {
        std::size_t n = 1;
        if (property.counts) {
          const auto count_of = [&](auto& counts) {
            source.append(1, counts);
            if (counts.back() < 0) {
              source.refuse("has a list of length " + std::to_string(counts.back()));
            }
            return static_cast<std::size_t>(counts.back());
          };
          n = std::visit(count_of, *property.counts);
        }
        std::visit([&](auto& values) { source.append(n, values); }, property.values);
      }
      source.end_record();
    }
  }
  source.end();
}

}  // namespace

PlyFile parse_ply(std::string_view data) {
  Header header(data);
  if (header.format == Format::text) {
    read_elements(Text(data, header.rest), header.file);
  } else {
    read_elements(Binary(data, header.rest, header.format == Format::big_endian), header.file);
  }
  return std::move(header.file);
}

}  // namespace dynmesh
