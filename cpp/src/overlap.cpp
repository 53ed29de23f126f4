#include "overlap.hpp"

#include <algorithm>
#include <cstdlib>

namespace dynmesh {
namespace {

/// First and past-the-last address.
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

/// Whether a column of `a` in some row meets a column of `b` in another row, or, where asked, in
/// the same row; both of one row pitch. `offset`: byte offset from the column of a to that of b.
bool columns_meet(const Extent& a, const Extent& b, std::ptrdiff_t offset, bool same_row_counts) {
  // Rows apart by n shift b by n pitches: they meet where -size_b < offset + n pitch < size_a.
  const std::ptrdiff_t pitch = std::abs(a.row_pitch);
  const auto meets = [&](std::ptrdiff_t shifted) {
    return shifted < static_cast<std::ptrdiff_t>(a.size) &&
           shifted > -static_cast<std::ptrdiff_t>(b.size);
  };
  if (pitch == 0) return meets(offset) && (same_row_counts || a.rows > 1);
  const std::ptrdiff_t nearest = -offset / pitch;
  const auto reach = static_cast<std::ptrdiff_t>(std::max(a.size, b.size)) / pitch + 1;
  const auto most = static_cast<std::ptrdiff_t>(std::max(a.rows, b.rows)) - 1;
  for (std::ptrdiff_t n = nearest - reach; n <= nearest + reach; ++n) {
    if (std::abs(n) <= most && (n != 0 || same_row_counts) && meets(offset + n * pitch)) {
      return true;
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
  if (a.row_pitch != b.row_pitch) return true;
  for (std::size_t i = 0; i < a.columns; ++i) {
    for (std::size_t j = 0; j < b.columns; ++j) {
      const std::ptrdiff_t offset = b.address - a.address +
                                    b.column_pitch * static_cast<std::ptrdiff_t>(j) -
                                    a.column_pitch * static_cast<std::ptrdiff_t>(i);
      if (columns_meet(a, b, offset, true)) return true;
    }
  }
  return false;
}

bool overlaps_itself(const Extent& a) {
  for (std::size_t i = 0; i < a.columns; ++i) {
    for (std::size_t j = 0; j < a.columns; ++j) {
      const std::ptrdiff_t offset =
          a.column_pitch * (static_cast<std::ptrdiff_t>(j) - static_cast<std::ptrdiff_t>(i));
      if (columns_meet(a, a, offset, i != j)) return true;
    }
  }
  return false;
}

}  // namespace dynmesh
