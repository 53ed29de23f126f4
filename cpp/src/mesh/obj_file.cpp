#include "mesh/obj_file.hpp"

#include <algorithm>
#include <cstddef>
#include <optional>
#include <string>
#include <system_error>

#include "mesh/mesh_text.hpp"
#include "support/parse_number.hpp"

namespace dynmesh {
namespace {

/// Iterates over the statements of a text: its lines without comments, those that end with a
/// backslash joined with the next one.
class Statements {
 public:
  explicit Statements(std::string_view text) : text_(text), lines_(text) {}

  /// Moves to the next statement. Returns false if there is none.
  bool next() {
    while (lines_.next()) {
      begin_ = lines_.line();
      std::string_view part = without_comment(begin_);
      if (!part.ends_with('\\')) {
        words_ = part;
      } else {
        joined_.clear();
        for (; part.ends_with('\\'); part = without_comment(lines_.line())) {
          joined_.append(part.substr(0, part.size() - 1)).append(" ");
          if (!lines_.next()) refuse_line(text_, begin_, "continues after the end of the file");
        }
        words_ = joined_.append(part);
      }
      if (!words_.empty()) return true;
    }
    return false;
  }
  /// Where the statement begins in the text.
  [[nodiscard]] std::string_view begin() const { return begin_; }
  [[nodiscard]] Words words() const { return Words(words_); }

 private:
  static std::string_view without_comment(std::string_view line) {
    line = line.substr(0, line.find('#'));
    while (!line.empty() && is_blank(line.back())) line.remove_suffix(1);
    return line;
  }

  std::string_view text_;
  Lines lines_;
  std::string_view begin_;
  std::string_view words_;
  std::string joined_;
};

std::vector<std::string_view> first_comments(std::string_view text) {
  std::vector<std::string_view> comments;
  for (Lines lines(text); lines.next();) {
    Words words(lines.line());
    if (!words.next()) continue;
    if (!words.word().starts_with('#')) break;
    comments.push_back(lines.line().substr(lines.line().find('#') + 1));
  }
  return comments;
}

class ObjParser {
 public:
  explicit ObjParser(std::string_view text) : text_(text), statements_(text) {}

  ObjFile parse() {
    file_.comments = first_comments(text_);
    while (statements_.next()) {
      Words words = statements_.words();
      words.next();
      if (words.word() == "v") {
        add_vertex(words);
      } else if (words.word() == "f") {
        add_face(words);
      }
    }
    if (largest_ >= n_vertices()) {
      refuse_line(text_, statement_of_largest_,
                  "there is no vertex " + std::to_string(largest_ + 1) + ", only " +
                      std::to_string(n_vertices()));
    }
    return std::move(file_);
  }

 private:
  [[nodiscard]] std::int64_t n_vertices() const {
    return static_cast<std::int64_t>(file_.mesh.positions.size() / 3);
  }

  [[noreturn]] void refuse(const std::string& why) const {
    refuse_line(text_, statements_.begin(), why);
  }

  /// A position, optionally followed by a weight of 1 or a colour of 3 or 4 numbers.
  void add_vertex(Words words) {
    std::size_t count = 0;
    double fourth = 1;
    for (; words.next(); ++count) {
      const std::optional<double> number = number_in(words.word());
      if (!number) refuse(quoted(words.word()) + " cannot be read as a double");
      if (count < 3) file_.mesh.positions.push_back(*number);
      if (count == 3) fourth = *number;
    }
    if (count < 3 || count == 5 || count > 7) {
      refuse("a vertex has 3 coordinates, not " + std::to_string(count));
    }
    if (count == 4 && fourth != 1) refuse("a vertex has a weight that is not 1");
  }

  void add_face(Words words) {
    std::int64_t size = 0;
    for (; words.next(); ++size) {
      const std::int64_t vertex = vertex_of(words.word());
      file_.mesh.corners.push_back(vertex);
      if (vertex <= largest_) continue;
      largest_ = vertex;
      statement_of_largest_ = statements_.begin();
    }
    if (size < 3) refuse("a face has " + std::to_string(size) + " corners, but needs 3");
    file_.mesh.sizes.push_back(size);
  }

  /// Returns the vertex of a corner, counted from 0. Texture coordinate and normal may follow it,
  /// as in "7/8/9". Negative numbers count back from the last vertex before this statement.
  [[nodiscard]] std::int64_t vertex_of(std::string_view corner) const {
    const std::string_view rest = corner.substr(corner.starts_with('+') ? 1 : 0);
    const char* const last = rest.data() + rest.size();
    std::int64_t number = 0;
    const auto [end, error] = parse_number(rest.data(), last, number);
    const bool has_references = end != last && *end == '/';
    const bool is_corner = error != std::errc::invalid_argument &&
                           (end == last || (has_references && std::all_of(end, last, [](char c) {
                                              return c == '/' || c == '-' || (c >= '0' && c <= '9');
                                            })));
    if (!is_corner) refuse(quoted(corner) + " is not a corner, such as 7, 7/8, 7//9 or 7/8/9");
    if (error != std::errc() || number == 0 || number < -n_vertices()) {
      refuse("there is no vertex " + std::string(rest.data(), end) + ", with " +
             std::to_string(n_vertices()) + " before this line");
    }
    return number > 0 ? number - 1 : n_vertices() + number;
  }

  std::string_view text_;
  Statements statements_;
  ObjFile file_;
  std::int64_t largest_ = -1;
  std::string_view statement_of_largest_;
};

}  // namespace

ObjFile parse_obj(std::string_view text) { return ObjParser(text).parse(); }

}  // namespace dynmesh
