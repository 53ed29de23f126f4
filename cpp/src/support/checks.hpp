/// Checks of arguments that several functions share.
#pragma once

#include <array>
#include <cstddef>
#include <cstdio>
#include <dynmesh/types.hpp>
#include <stdexcept>
#include <string>
#include <vector>

#include "support/geometry.hpp"

namespace dynmesh {

/// Returns "(x, y, z)" for messages.
template <class Real>
std::string to_text(const Vector3<Real>& v) {
  std::array<char, 96> text{};
  (void)std::snprintf(text.data(), text.size(), "(%.9g, %.9g, %.9g)", static_cast<double>(v.x),
                      static_cast<double>(v.y), static_cast<double>(v.z));
  return text.data();
}

/// Throws std::invalid_argument if `data` is null although there are rows.
inline void check_pointer(const char* argument, const void* data, std::size_t rows = 1) {
  if (rows > 0 && data == nullptr) {
    throw std::invalid_argument(std::string(argument) + ": is a null pointer");
  }
}

[[noreturn]] inline void refuse_row_stride(const char* argument, std::size_t rows) {
  throw std::invalid_argument(std::string(argument) + ": has a row stride of 0, with which its " +
                              std::to_string(rows) + " rows would be the same");
}

/// Throws std::invalid_argument if the rows of a view cannot exist. A stride of 0 is always a
/// mistake, often of a caller who assumes that it means packed.
template <class Real>
void check_view(const char* argument, const Points<Real>& points) {
  check_pointer(argument, points.data, points.count);
  if (points.count > 1 && points.row_stride == 0) refuse_row_stride(argument, points.count);
  if (points.count > 0 && points.column_stride == 0) {
    throw std::invalid_argument(
        std::string(argument) +
        ": has a column stride of 0, with which x, y and z would be the same");
  }
}

inline void check_view(const char* argument, const KnownMask& known) {
  check_pointer(argument, known.data, known.count);
  if (known.count > 1 && known.stride == 0) refuse_row_stride(argument, known.count);
}

/// Also throws std::invalid_argument unless there is a row for each vertex. `View` is Points or
/// KnownMask.
template <class View>
void check_rows(const char* argument, const View& view, std::size_t n_vertices) {
  if (view.count != n_vertices) {
    throw std::invalid_argument(std::string(argument) + ": has " + std::to_string(view.count) +
                                " rows, but the mesh has " + std::to_string(n_vertices) +
                                " vertices");
  }
  check_view(argument, view);
}

/// The positions of a frame that must be complete, with a row for each vertex.
template <class Real>
std::vector<Vector3<double>> finite_frame(const char* argument, Points<const Real> points,
                                          std::size_t n_vertices) {
  check_rows(argument, points, n_vertices);
  std::vector<Vector3<double>> frame(n_vertices);
  for (std::size_t v = 0; v < n_vertices; ++v) {
    frame[v] = in_double(row(points, v));
    if (is_finite(frame[v])) continue;
    throw std::invalid_argument(std::string(argument) + ": vertex " + std::to_string(v) +
                                " is at " + to_text(frame[v]) +
                                ", but this frame must be complete and finite");
  }
  return frame;
}

}  // namespace dynmesh
