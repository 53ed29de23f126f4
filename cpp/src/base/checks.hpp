/// Checks of arguments that several functions share.
#pragma once

#include <array>
#include <cstddef>
#include <cstdio>
#include <dynmesh/types.hpp>
#include <stdexcept>
#include <string>
#include <string_view>
#include <type_traits>

#include "base/geometry.hpp"

namespace dynmesh {

/// Returns texts and whole numbers as one text.
template <class... Parts>
std::string joined(const Parts&... parts) {
  const auto text = []<class Part>(const Part& part) {
    if constexpr (std::is_integral_v<Part>) {
      return std::to_string(part);
    } else {
      return std::string(part);
    }
  };
  return (text(parts) + ...);
}

/// Returns a number, or "(x, y, z)", for messages.
inline std::string to_text(double value, int digits = 9) {
  std::array<char, 32> text{};
  (void)std::snprintf(text.data(), text.size(), "%.*g", digits, value);
  return text.data();
}
inline std::string to_text(const Vector3& v, int digits = 9) {
  return joined("(", to_text(v.x, digits), ", ", to_text(v.y, digits), ", ", to_text(v.z, digits),
                ")");
}

/// Throws std::invalid_argument, with the name of an argument and texts and whole numbers that say
/// what is wrong with it.
template <class... Parts>
[[noreturn]] void refuse(std::string_view argument, const Parts&... why) {
  throw std::invalid_argument(joined(argument, ": ", why...));
}

/// Refuses a pointer that is null although there are rows.
inline void check_pointer(const char* argument, const void* data, std::size_t rows = 1) {
  if (rows > 0 && data == nullptr) refuse(argument, "is a null pointer");
}

[[noreturn]] inline void refuse_row_stride(const char* argument, std::size_t rows) {
  refuse(argument, "has a row stride of 0, with which its ", rows, " rows would be the same");
}

/// Refuses a view whose rows cannot exist. A stride of 0 is always a
/// mistake, often of a caller who assumes that it means packed.
template <class Real>
void check_view(const char* argument, const Points<Real>& points) {
  check_pointer(argument, points.data, points.count);
  if (points.count > 1 && points.row_stride == 0) refuse_row_stride(argument, points.count);
  if (points.count > 0 && points.column_stride == 0) {
    refuse(argument, "has a column stride of 0, with which x, y and z would be the same");
  }
}

inline void check_view(const char* argument, const KnownMask& known) {
  check_pointer(argument, known.data, known.count);
  if (known.count > 1 && known.stride == 0) refuse_row_stride(argument, known.count);
}

/// Also refuses it unless there is a row for each vertex. `View` is Points or KnownMask.
template <class View>
void check_rows(const char* argument, const View& view, std::size_t n_vertices) {
  if (view.count != n_vertices) {
    refuse(argument, "has ", view.count, " rows, but the mesh has ", n_vertices, " vertices");
  }
  check_view(argument, view);
}

}  // namespace dynmesh
