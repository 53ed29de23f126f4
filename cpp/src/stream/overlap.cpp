#include "stream/overlap.hpp"

#include <algorithm>
#include <cstdlib>

namespace dynmesh {
namespace {

/// The first address and the address after the last one.
struct Range {
  std::intptr_t low, high;
};

Range span_of(const Extent& e) {
  const std::ptrdiff_t rows = e.row_pitch * static_cast<std::ptrdiff_t>(e.rows - 1);
  const std::ptrdiff_t columns = e.column_pitch * static_cast<std::ptrdiff_t>(e.columns - 1);
  return {e.address + std::min<std::ptrdiff_t>(rows, 0) + std::min<std::ptrdiff_t>(columns, 0),
          e.address + std::max<std::ptrdiff_t>(rows, 0) + std::max<std::ptrdiff_t>(columns, 0) +
              static_cast<std::ptrdiff_t>(e.size)};
}

/// Whether a column of `a` and a column of `b`, which have the same row pitch, share bytes in
/// different rows or, if `same_row_counts`, in the same row. `offset` is the number of bytes from
/// the column of a to that of b in row 0.
bool columns_meet(const Extent& a, const Extent& b, std::ptrdiff_t offset, bool same_row_counts) {
  const auto meets = [&](std::ptrdiff_t apart) {
    return apart < static_cast<std::ptrdiff_t>(a.size) &&
           apart > -static_cast<std::ptrdiff_t>(b.size);
  };
  const std::ptrdiff_t pitch = a.row_pitch;
  if (pitch == 0) return meets(offset) && (same_row_counts || a.rows > 1);
  // Row i of a and row i + n of b are offset + n pitch apart, so only n near -offset / pitch
  // matter.
  const std::ptrdiff_t nearest = -offset / pitch;
  const auto reach = static_cast<std::ptrdiff_t>(std::max(a.size, b.size)) / std::abs(pitch) + 1;
  const std::ptrdiff_t first = std::max(nearest - reach, 1 - static_cast<std::ptrdiff_t>(a.rows));
  const std::ptrdiff_t last = std::min(nearest + reach, static_cast<std::ptrdiff_t>(b.rows) - 1);
  for (std::ptrdiff_t n = first; n <= last; ++n) {
    if ((n != 0 || same_row_counts) && meets(offset + n * pitch)) return true;
  }
  return false;
}

/// The same for any two columns. An array meets itself only in different columns of a row.
bool any_columns_meet(const Extent& a, const Extent& b, bool are_the_same) {
  for (std::size_t i = 0; i < a.columns; ++i) {
    for (std::size_t j = 0; j < b.columns; ++j) {
      const std::ptrdiff_t offset = b.address - a.address +
                                    b.column_pitch * static_cast<std::ptrdiff_t>(j) -
                                    a.column_pitch * static_cast<std::ptrdiff_t>(i);
      if (columns_meet(a, b, offset, !are_the_same || i != j)) return true;
    }
  }
  return false;
}

}  // namespace

bool overlap(const Extent& a, const Extent& b) {
  if (a.rows == 0 || b.rows == 0) return false;
  const Range first = span_of(a);
  const Range second = span_of(b);
  if (first.high <= second.low || second.high <= first.low) return false;
  return a.row_pitch != b.row_pitch || any_columns_meet(a, b, false);
}

bool overlaps_itself(const Extent& a) { return any_columns_meet(a, a, true); }

}  // namespace dynmesh
