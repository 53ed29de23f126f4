#include "plain_obj.hpp"

#include <algorithm>
#include <system_error>

#include "support/parse_number.hpp"

namespace dynmesh {
namespace {

bool is_letter(char c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z'); }

bool is_blank(char c) { return c == ' ' || c == '\t'; }

/// Iterates over the words of one line, which are separated by spaces and tabs.
class Words {
 public:
  explicit Words(std::string_view line) : at_(line.data()), end_(line.data() + line.size()) {}

  /// Moves to the next word. Returns false if there is none.
  bool next() {
    while (at_ != end_ && is_blank(*at_)) ++at_;
    return at_ != end_;
  }

  /// Reads a number at the beginning of the word.
  template <class Number>
  bool read(Number& value) {
    const auto [stopped, error] = parse_number(at_, end_, value);
    at_ = stopped;
    return error == std::errc();
  }

  /// Whether the last number was the whole word.
  [[nodiscard]] bool at_end_of_word() const { return at_ == end_ || is_blank(*at_); }

  /// Skips the texture coordinate and the normal of a corner, as in 7/8/9.
  void skip_references() {
    if (at_ == end_ || *at_ != '/') return;
    while (at_ != end_ && (*at_ == '/' || *at_ == '-' || (*at_ >= '0' && *at_ <= '9'))) ++at_;
  }

 private:
  const char* at_;
  const char* end_;
};

/// Reads a line after "v": a position, optionally followed by a weight of 1 or a colour of 3 or 4
/// numbers.
bool read_vertex(std::string_view line, PlainObj& mesh) {
  if (line.find('(') != std::string_view::npos) return false;  // from_chars would accept "nan(1)"
  double values[7];
  std::size_t count = 0;
  for (Words words(line); words.next(); ++count) {
    if (count == 7 || !words.read(values[count]) || !words.at_end_of_word()) return false;
  }
  const bool has_weight = count == 4;
  if (count != 3 && count < 6 && !(has_weight && values[3] == 1)) return false;
  mesh.positions.insert(mesh.positions.end(), values, values + 3);
  return true;
}

/// Reads a line after "f". Negative numbers count back from the last vertex before this line.
bool read_face(std::string_view line, PlainObj& mesh, std::int64_t& largest) {
  const auto n_before = static_cast<std::int64_t>(mesh.positions.size() / 3);
  std::int64_t size = 0;
  for (Words words(line); words.next(); ++size) {
    std::int64_t number = 0;
    if (!words.read(number)) return false;
    words.skip_references();
    if (!words.at_end_of_word() || number == 0 || number < -n_before) return false;
    mesh.corners.push_back(number > 0 ? number - 1 : n_before + number);
    largest = std::max(largest, mesh.corners.back());
  }
  mesh.sizes.push_back(size);
  return size >= 3;
}

/// Whether a line can be ignored: a comment, or a keyword that is neither "v" nor "f".
bool is_ignored(std::string_view line) {
  if (line.find('\r') != std::string_view::npos) return false;  // it also ends a line
  if (line.empty() || line[0] == '#') return true;
  if (line.find('\\') != std::string_view::npos) return false;  // it may continue a line
  const bool may_be_vertex_or_face = line[0] == 'v' || line[0] == 'f';
  return is_letter(line[0]) && (!may_be_vertex_or_face || (line.size() > 1 && is_letter(line[1])));
}

}  // namespace

std::optional<PlainObj> read_plain_obj(std::string_view text) {
  PlainObj mesh;
  std::int64_t largest = -1;
  while (!text.empty()) {
    const std::size_t end = std::min(text.find('\n'), text.size());
    std::string_view line = text.substr(0, end);
    text.remove_prefix(std::min(end + 1, text.size()));
    if (line.ends_with('\r')) line.remove_suffix(1);
    const bool is_read = line.starts_with("v ")   ? read_vertex(line.substr(2), mesh)
                         : line.starts_with("f ") ? read_face(line.substr(2), mesh, largest)
                                                  : is_ignored(line);
    if (!is_read) return std::nullopt;
  }
  if (largest >= static_cast<std::int64_t>(mesh.positions.size() / 3)) return std::nullopt;
  return mesh;
}

}  // namespace dynmesh
