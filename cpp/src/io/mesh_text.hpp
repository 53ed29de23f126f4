/// The text in mesh files: lines, words, numbers, and errors that name the line.
#pragma once

#include <cstddef>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

namespace dynmesh {

/// Thrown if the content of a mesh file is invalid. The message has one line of ASCII. It begins
/// with the line of the file, or names the element and the record of a binary file; it does not
/// contain the path.
class MalformedFile : public std::invalid_argument {
 public:
  using std::invalid_argument::invalid_argument;
};

/// Throws MalformedFile. `place` is a part of `text`, from whose position the line follows.
[[noreturn]] void refuse_line(std::string_view text, std::string_view place,
                              const std::string& why);

/// Returns `word` in quotes, shortened if it is long, with escapes for all but printable ASCII.
std::string quoted(std::string_view word);

/// Iterates over the lines of a text. A line ends with "\n", "\r\n" or "\r".
class Lines {
 public:
  explicit Lines(std::string_view text) : text_(text) {}

  /// Moves to the next line. Returns false if there is none.
  bool next();
  /// Returns the line, without its end.
  [[nodiscard]] std::string_view line() const { return line_; }
  /// Whether the line ends before the text does.
  [[nodiscard]] bool is_ended() const { return is_ended_; }

 private:
  std::string_view text_, line_;
  bool is_ended_ = false;
  std::size_t begin_ = 0;    // of the next line
  std::size_t newline_ = 0;  // the first at or after begin_, once it has been found
};

constexpr auto is_blank = [](char c) { return c == ' ' || (c >= '\t' && c <= '\r'); };

/// Appends the words of a line, which are separated by white space. Returns whether there are any.
bool add_words(std::string_view line, std::vector<std::string_view>& words);

/// Returns the text without the mark of UTF-8 at its beginning. Throws MalformedFile if it is in
/// UTF-16.
std::string_view without_byte_order_mark(std::string_view text);

/// Returns what stands before a comment, which begins with # at the start of a line or after white
/// space.
std::string_view without_comment(std::string_view line);

/// Returns the value of a decimal number, or of NaN or infinity as C libraries write them, with or
/// without a sign. Returns nothing if `word` is anything else or exceeds the range of double. Does
/// not depend on the locale.
std::optional<double> number_in(std::string_view word);

/// Returns the value of a word of digits. Returns nothing if `word` is anything else or too large.
std::optional<std::size_t> count_in(std::string_view word);

}  // namespace dynmesh
