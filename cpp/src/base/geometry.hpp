/// Functions on positions and edges.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <dynmesh/topology.hpp>
#include <dynmesh/types.hpp>
#include <limits>
#include <numeric>
#include <vector>

namespace dynmesh {

/// Where an index is missing.
constexpr Index none = -1;

/// An index, which is signed and has 32 bits, beside subscripts, which are not.
constexpr std::size_t at(Index i) { return static_cast<std::size_t>(i); }

/// The bounds of squared lengths in squared mean edge lengths. Only outliers reach the upper one.
inline constexpr double squared_length_floor = 1e-12;
inline constexpr double squared_length_ceiling = 1e24;

inline bool is_finite(const Vector3& v) {
  return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z);
}

/// The largest coordinate that is accepted in positions of this type. Products of larger ones with
/// weights could exceed the range of numbers, and a position that is not finite would spread over
/// the mesh permanently.
template <class Real>
constexpr double largest_coordinate = sizeof(Real) == 4 ? 1e18 : 1e200;

inline bool is_in_range(const Vector3& v, double largest) {
  // Nearly always, one comparison is enough.
  return std::abs(v.x) + std::abs(v.y) + std::abs(v.z) <= largest ||
         (std::abs(v.x) <= largest && std::abs(v.y) <= largest && std::abs(v.z) <= largest);
}

/// Converts `x` to Real. If it is out of the range of Real, for which the conversion is undefined
/// in C++, returns the largest number, which the checks of input and output recognise as beyond the
/// largest coordinate. NaN is preserved.
template <class Real>
constexpr Real saturated(double x) {
  constexpr auto largest = static_cast<double>(std::numeric_limits<Real>::max());
  return static_cast<Real>(std::clamp(x, -largest, largest));
}

/// Converts `x` to Real as `saturated` does, but preserves infinity, as of standard errors.
template <class Real>
constexpr Real saturated_or_infinite(double x) {
  const bool is_infinite = x == std::numeric_limits<double>::infinity();
  return is_infinite ? std::numeric_limits<Real>::infinity() : saturated<Real>(x);
}

/// Rows become double where they enter, and their own type again where they leave.
template <class Real>
Vector3 row(const Points<const Real>& points, std::size_t i) {
  return {static_cast<double>(points(i, 0)), static_cast<double>(points(i, 1)),
          static_cast<double>(points(i, 2))};
}
template <class Real>
void put_row(const Points<Real>& points, std::size_t i, const Vector3& position) {
  points(i, 0) = saturated<Real>(position.x);
  points(i, 1) = saturated<Real>(position.y);
  points(i, 2) = saturated<Real>(position.z);
}

inline double dot(const Vector3& a, const Vector3& b) { return a.x * b.x + a.y * b.y + a.z * b.z; }

inline Vector3 cross(const Vector3& a, const Vector3& b) {
  return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x};
}

/// v with length 1; zero if it has no direction.
inline Vector3 unit_of(const Vector3& v) {
  const double length = std::sqrt(squared_norm(v));
  return length > 0 && std::isfinite(length) ? (1 / length) * v : Vector3{};
}

/// The normal of a triangle, as long as twice its area.
inline Vector3 normal_of(const Triangle& face, Field x) {
  return cross(x[at(face[1])] - x[at(face[0])], x[at(face[2])] - x[at(face[0])]);
}

/// Packs the values of equal keys, from 0 to `n_keys` - 1, into lists: `add(visit)` calls
/// `visit(key, value)`, the same calls each time. Each list has the order of the calls.
template <class Add>
Cells lists_by_key(std::size_t n_keys, const Add& add) {
  Cells lists;
  lists.offsets.assign(n_keys + 1, 0);
  add([&](Index key, Index) { ++lists.offsets[key + 1]; });
  std::partial_sum(lists.offsets.begin(), lists.offsets.end(), lists.offsets.begin());
  lists.neighbours.resize(at(lists.offsets[n_keys]));
  std::vector<Index> filled(lists.offsets.begin(), lists.offsets.end() - 1);
  add([&](Index key, Index value) { lists.neighbours[filled[key]++] = value; });
  return lists;
}

/// Returns how much longer or shorter edges became on average: 1 - the shorter length / the longer
/// one. Edges without a length do not count.
inline double mean_stretch(const Cells& cells, Field before, Field after) {
  double sum = 0;
  double n_edges = 0;
  for (std::size_t v = 0; v < before.size(); ++v) {
    for (const Index n : cells[v]) {
      const double was = std::sqrt(squared_norm(before[n] - before[v]));
      const double is = std::sqrt(squared_norm(after[n] - after[v]));
      if (!(was > 0) && !(is > 0)) continue;
      sum += 1 - std::min(was, is) / std::max(was, is);
      n_edges += 1;
    }
  }
  return n_edges > 0 ? sum / n_edges : 0;
}

/// Returns h, the mean edge length of `frame`, or 1 if it is zero or there are no edges.
inline double mean_edge_length(const Cells& cells, Field frame) {
  double sum = 0;
  for (std::size_t v = 0; v < cells.size(); ++v) {
    for (const Index n : cells[v]) {
      const auto edge = frame[n] - frame[v];
      sum += std::hypot(edge.x, edge.y, edge.z);
    }
  }
  const auto mean = saturated<double>(sum / static_cast<double>(cells.neighbours.size()));
  return mean > 0 ? mean : 1;
}

}  // namespace dynmesh
