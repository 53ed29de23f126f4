/// What positions and edges are measured by.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <dynmesh/topology.hpp>
#include <dynmesh/types.hpp>
#include <limits>
#include <span>

#include "support/length_limits.hpp"

namespace dynmesh {

template <class Real>
bool is_finite(const Vector3<Real>& v) {
  return std::isfinite(v.x) && std::isfinite(v.y) && std::isfinite(v.z);
}

/// Larger coordinates are refused: times the largest weights of eq. (4) they would run out of Real,
/// and a position that is not finite would spread over the mesh and stay.
template <class Real>
constexpr Real largest_coordinate = sizeof(Real) == 4 ? Real(1e18) : Real(1e200);

template <class Real>
bool is_in_range(const Vector3<Real>& v) {
  const auto small = [](Real x) {
    return x <= largest_coordinate<Real> && -x <= largest_coordinate<Real>;
  };
  return small(v.x) && small(v.y) && small(v.z);
}

template <class Real>
Vector3<Real> row(const Points<const Real>& points, std::size_t i) {
  return {points(i, 0), points(i, 1), points(i, 2)};
}

/// `x` as a Real. Where Real has not its range, which C++ leaves undefined, the largest one: the
/// checks of what comes in and goes out find that it is beyond the largest coordinate. NaN stays.
template <class Real>
constexpr Real saturated(double x) {
  constexpr auto largest = static_cast<double>(std::numeric_limits<Real>::max());
  return static_cast<Real>(std::clamp(x, -largest, largest));
}

template <class Real>
Vector3<double> in_double(const Vector3<Real>& v) {
  return {static_cast<double>(v.x), static_cast<double>(v.y), static_cast<double>(v.z)};
}

template <class Real>
Real dot(const Vector3<Real>& a, const Vector3<Real>& b) {
  return a.x * b.x + a.y * b.y + a.z * b.z;
}

/// h: the mean edge length of `frame`, 1 where that is zero or there is no edge.
template <class Real>
Real mean_edge_length(const Cells& cells, std::span<const Vector3<Real>> frame) {
  double sum = 0;
  for (std::size_t v = 0; v < cells.size(); ++v) {
    const auto vertex = static_cast<Index>(v);
    for (const Index n : cells[vertex]) {
      const auto edge = frame[static_cast<std::size_t>(n)] - frame[v];
      sum += std::hypot(static_cast<double>(edge.x), static_cast<double>(edge.y),
                        static_cast<double>(edge.z));
    }
  }
  const auto mean = saturated<Real>(sum / static_cast<double>(cells.neighbours.size()));
  return mean > 0 ? mean : Real{1};
}

}  // namespace dynmesh
