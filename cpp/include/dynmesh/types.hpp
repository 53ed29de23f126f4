/// The layout of arrays at the interface, which is the same in all other headers.
///
/// Positions are rows x, y, z of `float` or `double`, one row per vertex, in any unit of length.
/// Vertex indices are 32-bit integers and count from 0. The library never keeps a pointer that it
/// was given.
#pragma once

#if (defined(_MSVC_LANG) ? _MSVC_LANG : __cplusplus) < 202002L
#error "dynmesh needs C++20; compile with -std=c++20 or /std:c++20"
#endif

#ifdef _GLIBCXX_DEBUG
#error "with _GLIBCXX_DEBUG, vectors have another layout than in dynmesh; use _GLIBCXX_ASSERTIONS"
#endif

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <type_traits>

namespace dynmesh {

/// A vertex, half-edge or generation number.
using Index = std::int32_t;

/// A view of `count` positions in the caller's memory. Coordinate c of row i is `data[i *
/// row_stride + c * column_stride]`. Strides are given in elements, not bytes, and may be negative,
/// so interleaved vertex buffers and planar x, y, z arrays can be read and written without copying.
/// A stride of 0, with which several rows or coordinates would share the same memory, is refused
/// with std::invalid_argument.
///
///     struct Vertex { float position[3]; float normal[3]; std::uint8_t seen; };
///     Points<float> points(buffer[0].position, k, sizeof(Vertex) / sizeof(float));
///     KnownMask known(&buffer[0].seen, k, sizeof(Vertex));
///     completer.push(points, known, points);
///
/// `Points<const Real>` can be read, `Points<Real>` can also be written.
template <class Real>
struct Points {
  Real* data = nullptr;
  std::size_t count = 0;
  std::ptrdiff_t row_stride = 3;
  std::ptrdiff_t column_stride = 1;

  Points() = default;
  Points(Real* first, std::size_t rows, std::ptrdiff_t per_row = 3, std::ptrdiff_t per_column = 1)
      : data(first), count(rows), row_stride(per_row), column_stride(per_column) {}

  /// Converts a writable view to a read-only one.
  template <class Mutable>
  requires std::is_same_v<const Mutable, Real> Points(
      const Points<Mutable>& other)  // NOLINT(google-explicit-constructor)
      : Points(other.data, other.count, other.row_stride, other.column_stride) {}

  Real& operator()(std::size_t row, std::size_t column) const {
    return data[static_cast<std::ptrdiff_t>(row) * row_stride +
                static_cast<std::ptrdiff_t>(column) * column_stride];
  }
};

/// A known mask: a view of `count` bytes, one per vertex, which are non-zero if the position of the
/// vertex was observed in this frame. `stride` is given in bytes, may be negative, and must not be
/// 0.
struct KnownMask {
  const std::uint8_t* data = nullptr;
  std::size_t count = 0;
  std::ptrdiff_t stride = 1;

  KnownMask() = default;
  KnownMask(const std::uint8_t* first, std::size_t rows, std::ptrdiff_t step = 1)
      : data(first), count(rows), stride(step) {}
  KnownMask(const bool* first, std::size_t rows, std::ptrdiff_t step = 1)
      : KnownMask(reinterpret_cast<const std::uint8_t*>(first), rows, step) {}

  bool operator[](std::size_t row) const {
    return data[static_cast<std::ptrdiff_t>(row) * stride] != 0;
  }
};

/// The vertices of a face, counterclockwise as seen from outside.
using Triangle = std::array<Index, 3>;

/// A view of `count` packed triangles of three vertex indices each.
struct Faces {
  const Index* data = nullptr;
  std::size_t count = 0;

  Triangle operator[](std::size_t face) const {
    return {data[3 * face], data[3 * face + 1], data[3 * face + 2]};
  }
};

/// A position or a motion vector. It is padded to four numbers, so that it can be loaded with one
/// instruction.
struct alignas(4 * sizeof(double)) Vector3 {
  double x = 0;
  double y = 0;
  double z = 0;
  double unused = 0;

  friend Vector3 operator+(const Vector3& a, const Vector3& b) {
    return {a.x + b.x, a.y + b.y, a.z + b.z};
  }
  friend Vector3 operator-(const Vector3& a, const Vector3& b) {
    return {a.x - b.x, a.y - b.y, a.z - b.z};
  }
  friend Vector3 operator*(double factor, const Vector3& a) {
    return {factor * a.x, factor * a.y, factor * a.z};
  }
  friend double squared_norm(const Vector3& a) { return a.x * a.x + a.y * a.y + a.z * a.z; }
};

/// Positions, or other vectors, of the vertices.
using Field = std::span<const Vector3>;

}  // namespace dynmesh
