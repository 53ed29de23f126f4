#include <algorithm>
#include <cstddef>
#include <span>
#include <string>

#include "mesh/mesh_text.hpp"
#include "mesh/obj_file.hpp"

namespace dynmesh {
namespace {

/// Whether `word` is OFF or a variant of it, such as COFF or STOFF.
bool begins_off(std::string_view word) {
  if (!word.ends_with("OFF")) return false;
  word.remove_suffix(3);
  return word.find_first_not_of("CNST") == std::string_view::npos;
}

class OffParser {
 public:
  explicit OffParser(std::string_view text) : text_(text) {}

  PolygonMesh parse() {
    bool began = false;
    std::vector<std::string_view> words;
    for (Lines lines(text_); lines.next();) {
      line_ = lines.line();
      words.clear();
      for (Words each(line_.substr(0, line_.find('#'))); each.next();) words.push_back(each.word());
      std::span<const std::string_view> rest = words;
      if (!began && !rest.empty()) {
        began = true;
        if (begins_off(rest[0])) {
          is_plain_ = rest[0] == "OFF";
          rest = rest.subspan(1);
        }
      }
      if (rest.empty()) continue;
      if (counts_.size() < 2) {
        add_counts(rest);
      } else if (n_vertices() < counts_[0]) {
        add_vertex(rest);
      } else if (mesh_.sizes.size() < counts_[1]) {
        add_face(rest);
      }
    }
    if (counts_.size() < 2) throw MalformedFile("ends before the numbers of vertices and faces");
    if (n_vertices() < counts_[0] || mesh_.sizes.size() < counts_[1]) {
      throw MalformedFile("declares " + std::to_string(counts_[0]) + " vertices and " +
                          std::to_string(counts_[1]) + " faces, but ends after " +
                          std::to_string(n_vertices()) + " and " +
                          std::to_string(mesh_.sizes.size()));
    }
    return std::move(mesh_);
  }

 private:
  [[nodiscard]] std::size_t n_vertices() const { return mesh_.positions.size() / 3; }

  [[noreturn]] void refuse(const std::string& why) const { refuse_line(text_, line_, why); }

  [[nodiscard]] std::size_t count(std::string_view word) const {
    const std::optional<std::size_t> value = count_in(word);
    if (!value) refuse(quoted(word) + " is not a count");
    return *value;
  }

  void add_counts(std::span<const std::string_view> words) {
    if (std::ranges::find(words, "BINARY") != words.end()) {
      throw MalformedFile("binary OFF is not supported; convert it to text or to PLY");
    }
    for (const auto word : words) counts_.push_back(count(word));
  }

  void add_vertex(std::span<const std::string_view> words) {
    if (words.size() < 3 || (is_plain_ && words.size() > 3)) {
      refuse("a vertex has 3 coordinates, not " + std::to_string(words.size()));
    }
    for (const auto word : words.first(3)) {
      const std::optional<double> number = number_in(word);
      if (!number) refuse(quoted(word) + " cannot be read as a double");
      mesh_.positions.push_back(*number);
    }
  }

  void add_face(std::span<const std::string_view> words) {
    const std::size_t size = count(words[0]);
    if (size < 3) refuse("a face has " + std::to_string(size) + " corners, but needs 3");
    if (size > words.size() - 1) {
      refuse("a face has " + std::to_string(size) + " corners, but lists " +
             std::to_string(words.size() - 1));
    }
    for (const auto word : words.subspan(1, size)) {
      const std::size_t vertex = count(word);
      if (vertex >= counts_[0]) {
        refuse("there is no vertex " + quoted(word) + ", counted from 0, of " +
               std::to_string(counts_[0]));
      }
      mesh_.corners.push_back(static_cast<std::int64_t>(vertex));
    }
    mesh_.sizes.push_back(static_cast<std::int64_t>(size));
  }

  std::string_view text_;
  std::string_view line_;
  std::vector<std::size_t> counts_;  // of vertices, faces and edges; that of edges is not used
  bool is_plain_ = true;  // no normals, colours or texture coordinates after the positions
  PolygonMesh mesh_;
};

}  // namespace

PolygonMesh parse_off(std::string_view text) { return OffParser(text).parse(); }

}  // namespace dynmesh
