#include "stream/overlap.hpp"

#include <doctest/doctest.h>

#include <random>
#include <set>

#include "meshes.hpp"

namespace dynmesh::testing {
namespace {

/// The addresses of all bytes of an extent.
std::multiset<std::intptr_t> bytes_of(const Extent& e) {
  std::multiset<std::intptr_t> bytes;
  for (std::size_t row = 0; row < e.rows; ++row) {
    for (std::size_t column = 0; column < e.columns; ++column) {
      for (std::size_t b = 0; b < e.size; ++b) {
        bytes.insert(e.address + static_cast<std::ptrdiff_t>(row) * e.row_pitch +
                     static_cast<std::ptrdiff_t>(column) * e.column_pitch +
                     static_cast<std::ptrdiff_t>(b));
      }
    }
  }
  return bytes;
}

bool share(const Extent& a, const Extent& b) {
  const auto of_b = bytes_of(b);
  for (const auto byte : bytes_of(a)) {
    if (of_b.contains(byte)) return true;
  }
  return false;
}

TEST_CASE("overlap is exact for equal pitches and conservative otherwise") {
  std::mt19937 random(7);
  const auto draw = [&](int low, int high) {
    return std::uniform_int_distribution(low, high)(random);
  };
  int met = 0;
  for (int trial = 0; trial < 20000; ++trial) {
    const std::ptrdiff_t pitch = draw(-20, 20);
    const auto extent = [&](std::ptrdiff_t row_pitch) {
      return Extent{draw(0, 60), static_cast<std::size_t>(draw(0, 5)),
                    row_pitch,   static_cast<std::size_t>(draw(1, 3)),
                    draw(-8, 8), static_cast<std::size_t>(draw(1, 4))};
    };
    const Extent a = extent(pitch);
    const Extent b = extent(draw(0, 2) == 0 ? draw(-20, 20) : static_cast<int>(pitch));
    met += share(a, b) ? 1 : 0;
    if (a.row_pitch == b.row_pitch) {
      CHECK(overlap(a, b) == share(a, b));
    } else if (share(a, b)) {
      CHECK(overlap(a, b));
    }

    std::set<std::intptr_t> distinct;
    const auto bytes = bytes_of(a);
    distinct.insert(bytes.begin(), bytes.end());
    if (a.rows > 0) CHECK(overlaps_itself(a) == (distinct.size() < bytes.size()));
  }
  CHECK(met > 1000);
}

}  // namespace
}  // namespace dynmesh::testing
