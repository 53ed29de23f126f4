/// Settings, faces and arrays for a completer, from arbitrary bytes.
#pragma once

#include <cstddef>
#include <cstring>
#include <dynmesh/settings.hpp>
#include <dynmesh/types.hpp>
#include <span>
#include <vector>

#include "input.hpp"

namespace dynmesh::fuzz {

/// Rows in memory with gaps between them, which must not be written.
template <class Real>
struct Rows {
  std::vector<Real> memory;
  std::ptrdiff_t first = 0;
  std::size_t count = 0;
  std::ptrdiff_t row_stride = 3;
  std::ptrdiff_t column_stride = 1;

  Rows(Input& input, std::size_t rows) : count(rows) {
    const std::size_t layout = input.below(4);
    const auto n = static_cast<std::ptrdiff_t>(rows);
    if (layout == 1) row_stride = 5;
    if (layout == 2) row_stride = -4, first = 4 * std::max<std::ptrdiff_t>(n - 1, 0);
    if (layout == 3) row_stride = 1, column_stride = n + 1;
    memory.assign(5 * rows + 16, filler());
  }
  static Real filler() { return static_cast<Real>(-77.25); }

  [[nodiscard]] Points<Real> view() {
    return {memory.data() + first, count, row_stride, column_stride};
  }
  void fill(std::span<const Real> packed) {
    for (std::size_t i = 0; i < packed.size(); ++i) view()(i / 3, i % 3) = packed[i];
  }
  /// Also checks that the gaps between the rows are unchanged.
  [[nodiscard]] std::vector<Real> packed() {
    std::vector<Real> rows(3 * count);
    std::vector<Real> rest = memory;
    for (std::size_t i = 0; i < rows.size(); ++i) {
      Real& place = view()(i / 3, i % 3);
      rows[i] = place;
      rest[static_cast<std::size_t>(&place - memory.data())] = filler();
    }
    for (const Real x : rest) require(x == filler(), "nothing is written between the rows");
    return rows;
  }
};

template <class Real>
bool same_bytes(std::span<const Real> a, std::span<const Real> b) {
  return a.size() == b.size() &&
         (a.empty() || std::memcmp(a.data(), b.data(), a.size_bytes()) == 0);
}

inline Settings settings_of(Input& input) {
  Settings settings;
  const std::size_t bits = input.below(256);
  settings.method = (bits & 1) != 0 ? Method::detail : Method::motion;
  settings.disconnected = (bits & 2) != 0 ? DisconnectedRule::hold : DisconnectedRule::follow;
  settings.threads = (bits & 12) == 12 ? 2 : 1;
  if (settings.method == Method::motion ||
      (bits & 0xf0) == 0xf0) {  // otherwise refused, which is rare
    settings.revisit = (bits & 16) == 0;
    settings.extra_iterations = static_cast<Index>(input.below(20)) - ((bits & 32) != 0 ? 1 : 0);
  }
  if (settings.method == Method::detail || (bits & 0xf0) == 0xe0) {
    settings.reject_outliers = (bits & 64) != 0;
    settings.learn = (bits & 32) != 0;
    settings.uncertainty = (bits & 4) != 0;
    if ((bits & 128) != 0) settings.noise = coordinate<double>(input, input.flip());
  }
  return settings;
}

inline std::vector<Index> faces_of(Input& input, std::size_t k) {
  std::vector<Index> faces;
  const std::size_t shape = input.below(8);
  const auto n = static_cast<Index>(k);
  if (shape < 5) {  // a strip, open or closed, in which triangles may occur twice
    const Index end = shape < 2 ? n : n - 2;
    for (Index v = 0; v < end; ++v) {
      for (const Index corner : {v, (v + 1) % n, (v + 2) % n}) faces.push_back(corner);
    }
  }
  const std::size_t more = shape == 0 || shape >= 5 ? 1 + input.below(48) : input.below(4);
  for (std::size_t i = 0; i < 3 * more; ++i) {
    const auto v = static_cast<Index>(input.below(k));
    faces.push_back(shape == 7 && input.below(64) == 63 ? input.take<Index>() : v);
  }
  return faces;
}

}  // namespace dynmesh::fuzz
