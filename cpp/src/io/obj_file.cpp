#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <system_error>
#include <utility>

#include "io/mesh_files.hpp"
#include "io/mesh_text.hpp"
#include "io/parse_number.hpp"

namespace dynmesh {
namespace {

using Line = std::span<const std::string_view>;

constexpr std::array<std::string_view, 5> further_keywords = {"vt", "vn", "usemtl", "g", "o"};

std::vector<std::string_view> first_comments(std::string_view text) {
  std::vector<std::string_view> comments;
  for (Lines lines(text); lines.next();) {
    const std::string_view line = lines.line();
    const auto first = std::ranges::find_if_not(line, is_blank);
    if (first == line.end()) continue;
    if (*first != '#') break;
    comments.emplace_back(first + 1, line.end());
  }
  return comments;
}

/// Errors name the line.
class ObjParser {
 public:
  explicit ObjParser(std::string_view text) : text_(without_byte_order_mark(text)), lines_(text_) {}

  ObjFile parse() {
    while (next_statement()) {
      const Line values = std::span(words_).subspan(1);
      if (words_[0] == "v") {
        add_vertex(values);
      } else if (words_[0] == "f") {
        add_face(values);
      } else {
        note(words_[0]);
      }
    }
    if (largest_ >= static_cast<std::int64_t>(n_vertices())) {
      place_ = place_of_largest_;
      refuse("there is no vertex " + std::to_string(largest_ + 1) + ", only " +
             std::to_string(n_vertices()));
    }
    return {std::move(mesh_), first_comments(text_), std::move(further_), has_colours_};
  }

 private:
  [[noreturn]] void refuse(const std::string& why) const { refuse_line(text_, place_, why); }

  [[nodiscard]] std::size_t n_vertices() const { return mesh_.positions.size() / 3; }

  [[nodiscard]] double number(std::string_view word) const {
    const std::optional<double> value = number_in(word);
    if (!value) refuse(quoted(word) + " cannot be read as a double");
    return *value;
  }

  /// Moves to the next statement: a line without comments, which is joined with the next one if it
  /// ends with a backslash. Returns false if there is none.
  bool next_statement() {
    words_.clear();
    while (words_.empty() && lines_.next()) {
      place_ = lines_.line();
      while (add_words(without_comment(lines_.line()), words_) && words_.back().ends_with('\\')) {
        words_.back().remove_suffix(1);
        if (words_.back().empty()) words_.pop_back();
        if (!lines_.next()) refuse("continues after the end of the file");
      }
    }
    return !words_.empty();
  }

  /// A position, optionally followed by a weight of 1 or a colour of 3 or 4 numbers.
  void add_vertex(Line words) {
    double fourth = 1;
    for (std::size_t i = 0; i < words.size(); ++i) {
      const double value = number(words[i]);
      if (i < 3) mesh_.positions.push_back(value);
      if (i == 3) fourth = value;
    }
    const std::size_t count = words.size();
    if (count < 3 || count == 5 || count > 7) {
      refuse("a vertex has 3 coordinates, not " + std::to_string(count));
    }
    if (count == 4 && fourth != 1) refuse("a vertex has a weight that is not 1");
    has_colours_ |= count > 4;
  }

  void note(std::string_view keyword) {
    if (std::ranges::find(further_, keyword) != further_.end()) return;
    const auto known = std::ranges::find(further_keywords, keyword);
    if (known != further_keywords.end()) further_.push_back(*known);
  }

  void add_face(Line words) {
    for (const auto word : words) {
      const std::int64_t vertex = vertex_of(word);
      mesh_.corners.push_back(vertex);
      if (vertex <= largest_) continue;
      largest_ = vertex;
      place_of_largest_ = place_;
    }
    if (words.size() < 3) {
      refuse("a face has " + std::to_string(words.size()) + " corners, but needs 3");
    }
    mesh_.sizes.push_back(static_cast<std::int64_t>(words.size()));
  }

  /// Returns the vertex of a corner, counted from 0. Texture coordinate and normal may follow it,
  /// as in "7/8/9". Negative numbers count back from the last vertex before this statement.
  [[nodiscard]] std::int64_t vertex_of(std::string_view corner) const {
    const std::string_view rest = corner.substr(corner.starts_with('+') ? 1 : 0);
    const char* const last = rest.data() + rest.size();
    std::int64_t number = 0;
    const auto [end, error] = parse_number(rest.data(), last, number);
    const std::string_view references(end, last);
    const bool is_corner =
        error != std::errc::invalid_argument &&
        (references.empty() || (references.starts_with('/') &&
                                references.find_first_not_of("/-0123456789") == references.npos));
    if (!is_corner) refuse(quoted(corner) + " is not a corner, such as 7, 7/8, 7//9 or 7/8/9");
    const auto before = static_cast<std::int64_t>(n_vertices());
    if (error != std::errc() || number == 0 || number < -before) {
      refuse("there is no vertex " + std::string(rest.data(), end) + ", with " +
             std::to_string(before) + " before this line");
    }
    return number > 0 ? number - 1 : before + number;
  }

  std::string_view text_;
  Lines lines_;
  std::string_view place_;  // of what is being read
  PolygonMesh mesh_;
  std::vector<std::string_view> words_;    // of the statement
  std::vector<std::string_view> further_;  // keywords, each once
  bool has_colours_ = false;
  std::int64_t largest_ = -1;
  std::string_view place_of_largest_;
};

}  // namespace

ObjFile parse_obj(std::string_view text) { return ObjParser(text).parse(); }

}  // namespace dynmesh
