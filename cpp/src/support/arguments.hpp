/// What several calls refuse of their arguments, in the same words.
#pragma once

#include <array>
#include <cstddef>
#include <cstdio>
#include <dynmesh/types.hpp>
#include <stdexcept>
#include <string>

namespace dynmesh {

/// "(x, y, z)", for people.
template <class Real>
std::string to_text(const Vector3<Real>& v) {
  std::array<char, 96> text{};
  (void)std::snprintf(text.data(), text.size(), "(%.9g, %.9g, %.9g)", static_cast<double>(v.x),
                      static_cast<double>(v.y), static_cast<double>(v.z));
  return text.data();
}

/// Throws std::invalid_argument where `rows` rows cannot lie at `data`.
inline void check_pointer(const char* argument, const void* data, std::size_t rows) {
  if (rows > 0 && data == nullptr) {
    throw std::invalid_argument(std::string(argument) + ": is a null pointer");
  }
}

/// Throws std::invalid_argument unless there is a row for each vertex.
inline void check_rows(const char* argument, const void* data, std::size_t rows,
                       std::size_t n_vertices) {
  if (rows != n_vertices) {
    throw std::invalid_argument(std::string(argument) + ": has " + std::to_string(rows) +
                                " rows, but the mesh has " + std::to_string(n_vertices) +
                                " vertices");
  }
  check_pointer(argument, data, rows);
}

}  // namespace dynmesh
