/// Completes frames and returns them as vectors.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <dynmesh/completer.hpp>
#include <limits>
#include <vector>

namespace dynmesh::testing {

template <class Real>
std::vector<Real> push(Completer<Real>& completer, const std::vector<Real>& frame,
                       const std::vector<std::uint8_t>& known) {
  std::vector<Real> completed(frame.size());
  const std::size_t k = known.size();
  completer.push({frame.data(), k}, {known.data(), k}, {completed.data(), k});
  return completed;
}

/// The largest magnitude of a coordinate; infinite if one is not finite.
template <class Real>
double largest(const std::vector<Real>& values) {
  double most = 0;
  for (const Real x : values) {
    if (!std::isfinite(x)) return std::numeric_limits<double>::infinity();
    most = std::max(most, std::abs(static_cast<double>(x)));
  }
  return most;
}

}  // namespace dynmesh::testing
