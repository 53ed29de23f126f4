/// Numbers in text, in the same way in every locale.
#pragma once

#include <cerrno>
#include <charconv>
#include <clocale>
#include <cmath>
#include <cstdlib>
#include <string>
#include <string_view>
#include <system_error>
#include <type_traits>
#if defined(__APPLE__)
#include <xlocale.h>
#endif

namespace dynmesh {

#if !defined(_WIN32)
/// As std::from_chars for a decimal number, with strtod: libc++ before version 20 lacks it.
/// Infinity and NaN in words are not accepted.
inline std::from_chars_result parse_with_strtod(const char* first, const char* last,
                                                double& value) {
  constexpr std::string_view characters = "0123456789.eE+-";
  const std::string_view text(first, static_cast<std::size_t>(last - first));
  const std::string number(text.substr(0, text.find_first_not_of(characters)));
  if (number.empty() || number[0] == '+') return {first, std::errc::invalid_argument};
  static const locale_t plain = newlocale(LC_ALL_MASK, "C", nullptr);
  char* end = nullptr;
  errno = 0;
  const double parsed = strtod_l(number.c_str(), &end, plain);
  if (end == number.c_str()) return {first, std::errc::invalid_argument};
  const char* stopped = first + (end - number.c_str());
  // ERANGE is also set for numbers that are smaller than normal ones but not 0.
  if (errno == ERANGE && (parsed == 0 || std::isinf(parsed))) {
    return {stopped, std::errc::result_out_of_range};
  }
  value = parsed;
  return {stopped, {}};
}
#endif

/// As std::from_chars, for decimal and whole numbers.
template <class Number>
std::from_chars_result parse_number(const char* first, const char* last, Number& value) {
#if !defined(__cpp_lib_to_chars) && !defined(_WIN32)
  if constexpr (std::is_floating_point_v<Number>)
    return parse_with_strtod(first, last, value);
  else
#endif
    return std::from_chars(first, last, value);
}

}  // namespace dynmesh
