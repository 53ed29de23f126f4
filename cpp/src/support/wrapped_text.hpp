/// Breaks text into lines, for help texts and docstrings.
#pragma once

#include <cstddef>
#include <sstream>
#include <string>
#include <utility>

namespace dynmesh {

/// Returns `text` as lines of at most `width` columns, of which the first begins with `head` and
/// the others with `indent` spaces. A head shorter than the indentation is filled up to it.
inline std::string wrapped_text(std::string head, const std::string& text, std::size_t indent,
                                std::size_t width) {
  std::string lines;
  std::string line = std::move(head);
  const auto end_line = [&] {
    lines += line.substr(0, line.find_last_not_of(' ') + 1) + '\n';
    line.assign(indent, ' ');
  };
  if (!line.empty() && line.back() != ' ') line += ' ';
  if (line.size() < indent) line.resize(indent, ' ');
  std::istringstream words(text);
  for (std::string word; words >> word;) {
    if (line.size() + word.size() > width) end_line();
    line += word + ' ';
  }
  end_line();
  return lines;
}

}  // namespace dynmesh
