#include "io/mesh_text.hpp"

#include <algorithm>
#include <cstdio>
#include <limits>
#include <system_error>

#include "io/parse_number.hpp"

namespace dynmesh {
namespace {

char lowercase(char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c; }

/// Whether the whole word is a number.
template <class Number>
bool parse(std::string_view word, Number& value) {
  const char* last = word.data() + word.size();
  const auto [end, error] = parse_number(word.data(), last, value);
  return error == std::errc() && end == last;
}

/// NaN or infinity as C libraries write them: also nan(ind) and, of old ones, 1.#QNAN and 1.#INF00.
std::optional<double> not_finite_in(std::string_view magnitude) {
  std::string name(magnitude.substr(0, 40));
  std::ranges::transform(name, name.begin(), lowercase);
  if (name.starts_with("1.#")) name = name.substr(3, name.find_last_not_of('0') - 2);
  if (name == "inf" || name == "infinity") return std::numeric_limits<double>::infinity();
  constexpr std::string_view names[] = {"nan", "qnan", "snan", "nanq", "nans", "ind"};
  const bool is_nan = std::ranges::find(names, name) != std::end(names) ||
                      (name.starts_with("nan(") && name.ends_with(')'));
  return is_nan ? std::optional(std::numeric_limits<double>::quiet_NaN()) : std::nullopt;
}

}  // namespace

void refuse_line(std::string_view text, std::string_view place, const std::string& why) {
  Lines lines(text.substr(0, static_cast<std::size_t>(place.data() - text.data())));
  std::size_t number = 1;
  while (lines.next()) number += lines.is_ended() ? 1 : 0;
  throw MalformedFile("line " + std::to_string(number) + ": " + why);
}

std::string quoted(std::string_view word) {
  std::string shown = "'";
  for (const char c : word.substr(0, 60)) {
    char escaped[8];
    const bool is_printable = c >= ' ' && c <= '~';
    (void)std::snprintf(escaped, sizeof escaped, is_printable ? "%c" : "\\x%02x",
                        static_cast<unsigned char>(c));
    shown += escaped;
  }
  return shown + (word.size() > 60 ? "...'" : "'");
}

bool Lines::next() {
  if (begin_ == text_.size()) return false;
  // The newline is remembered, so that a text without one is searched only once.
  if (newline_ < begin_ || begin_ == 0) newline_ = std::min(text_.find('\n', begin_), text_.size());
  line_ = text_.substr(begin_, newline_ - begin_);
  line_ = line_.substr(0, line_.find('\r'));
  begin_ += line_.size();
  is_ended_ = begin_ < text_.size();
  if (is_ended_) begin_ += text_.substr(begin_).starts_with("\r\n") ? 2 : 1;
  return true;
}

bool add_words(std::string_view line, std::vector<std::string_view>& words) {
  const std::size_t before = words.size();
  for (auto end = line.begin();;) {
    const auto begin = std::find_if_not(end, line.end(), is_blank);
    if (begin == line.end()) return words.size() > before;
    end = std::find_if(begin, line.end(), is_blank);
    words.emplace_back(begin, end);
  }
}

std::string_view without_byte_order_mark(std::string_view text) {
  if (text.starts_with("\xff\xfe") || text.starts_with("\xfe\xff")) {
    throw MalformedFile("line 1: is text in UTF-16; save it in UTF-8");
  }
  return text.substr(text.starts_with("\xef\xbb\xbf") ? 3 : 0);
}

std::string_view without_comment(std::string_view line) {
  std::size_t at = line.find('#');
  while (at != std::string_view::npos && at > 0 && !is_blank(line[at - 1])) {
    at = line.find('#', at + 1);
  }
  return line.substr(0, at);
}

std::optional<double> number_in(std::string_view word) {
  const bool has_sign = word.starts_with('-') || word.starts_with('+');
  const std::string_view magnitude = word.substr(has_sign ? 1 : 0);
  const char first = magnitude.empty() ? ' ' : magnitude[0];
  double value = 0;
  if ((first != '.' && (first < '0' || first > '9')) || !parse(magnitude, value)) {
    const std::optional<double> special = not_finite_in(magnitude);
    if (!special) return std::nullopt;
    value = *special;
  }
  return word.starts_with('-') ? -value : value;
}

std::optional<std::size_t> count_in(std::string_view word) {
  std::size_t count = 0;
  return parse(word, count) ? std::optional(count) : std::nullopt;
}

}  // namespace dynmesh
