/// Detects strided arrays that share memory.
#pragma once

#include <cstddef>
#include <cstdint>
#include <dynmesh/types.hpp>
#include <span>

namespace dynmesh {

/// An array of `rows` times `columns` elements of `size` bytes. Pitches are in bytes.
struct Extent {
  std::intptr_t address = 0;
  std::size_t rows = 0;
  std::ptrdiff_t row_pitch = 0;
  std::size_t columns = 1;
  std::ptrdiff_t column_pitch = 0;
  std::size_t size = 1;

  template <class Real>
  static Extent of(const Points<Real>& points) {
    constexpr auto size = static_cast<std::ptrdiff_t>(sizeof(Real));
    return {reinterpret_cast<std::intptr_t>(points.data),
            points.count,
            points.row_stride * size,
            3,
            points.column_stride * size,
            sizeof(Real)};
  }
  static Extent of(const KnownMask& known) {
    return {reinterpret_cast<std::intptr_t>(known.data), known.count, known.stride};
  }
  static Extent of(std::span<const Index> indices) {
    constexpr auto size = static_cast<std::ptrdiff_t>(sizeof(Index));
    return {
        reinterpret_cast<std::intptr_t>(indices.data()), indices.size(), size, 1, 0, sizeof(Index)};
  }

  bool operator==(const Extent&) const = default;
};

/// Whether the two arrays share a byte. The result is exact if both have the same row pitch, so
/// fields of one interleaved buffer do not count as overlapping. Otherwise the ranges of addresses
/// that they span are compared.
bool overlap(const Extent& a, const Extent& b);

/// Whether two elements of `a` share a byte.
bool overlaps_itself(const Extent& a);

}  // namespace dynmesh
