#include "base/overlap.hpp"

#include <algorithm>
#include <cstdlib>
#include <utility>

namespace dynmesh {
namespace {

/// The first address and the address after the last one.
std::pair<std::intptr_t, std::intptr_t> range_of(const Extent& e) {
  const std::ptrdiff_t rows = e.row_pitch * static_cast<std::ptrdiff_t>(e.rows - 1);
  const std::ptrdiff_t columns = e.column_pitch * static_cast<std::ptrdiff_t>(e.columns - 1);
  return {e.address + std::min<std::ptrdiff_t>(rows, 0) + std::min<std::ptrdiff_t>(columns, 0),
          e.address + std::max<std::ptrdiff_t>(rows, 0) + std::max<std::ptrdiff_t>(columns, 0) +
              static_cast<std::ptrdiff_t>(e.size)};
}

/// Whether elements of `a` and `b`, which have the same row pitch, share bytes. If they are the
/// same array, only different elements count.
bool any_meet(const Extent& a, const Extent& b, bool are_the_same) {
  const auto reach = static_cast<std::ptrdiff_t>(std::max(a.size, b.size));
  const std::ptrdiff_t pitch = a.row_pitch;
  const std::ptrdiff_t step = pitch == 0 ? 1 : pitch;  // if all rows are at one place, any will do
  for (std::size_t i = 0; i < a.columns; ++i) {
    for (std::size_t j = 0; j < b.columns; ++j) {
      const std::ptrdiff_t offset = b.address - a.address +
                                    b.column_pitch * static_cast<std::ptrdiff_t>(j) -
                                    a.column_pitch * static_cast<std::ptrdiff_t>(i);
      // Column i of row r of a and column j of row r + n of b are offset + n pitch apart, so only n
      // near -offset / pitch matter.
      const std::ptrdiff_t n_near = reach / std::abs(step) + 1;
      const auto first = std::max(-offset / step - n_near, 1 - static_cast<std::ptrdiff_t>(a.rows));
      const auto last = std::min(-offset / step + n_near, static_cast<std::ptrdiff_t>(b.rows) - 1);
      for (std::ptrdiff_t n = first; n <= last; ++n) {
        const std::ptrdiff_t apart = offset + n * pitch;
        const bool is_one_element = are_the_same && i == j && n == 0;
        if (!is_one_element && apart < static_cast<std::ptrdiff_t>(a.size) &&
            apart > -static_cast<std::ptrdiff_t>(b.size)) {
          return true;
        }
      }
    }
  }
  return false;
}

}  // namespace

bool overlap(const Extent& a, const Extent& b) {
  if (a.rows == 0 || b.rows == 0) return false;
  const auto [a_first, a_end] = range_of(a);
  const auto [b_first, b_end] = range_of(b);
  if (a_end <= b_first || b_end <= a_first) return false;
  return a.row_pitch != b.row_pitch || any_meet(a, b, false);
}

bool overlaps_itself(const Extent& a) { return any_meet(a, a, true); }

}  // namespace dynmesh
