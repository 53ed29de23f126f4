/// Preconditioned conjugate gradients (Hestenes and Stiefel 1952), for a few steps.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <span>

#include "support/geometry.hpp"

namespace dynmesh {

inline double dot(double a, double b) { return a * b; }

/// The vectors of the method, in the caller's memory and of equal size. Entry i belongs to system
/// i % `width`, so that systems with the same matrix are solved side by side.
template <class Value>
struct ConjugateVectors {
  std::span<Value> residual;        ///< r, at first that of the solution to begin with
  std::span<Value> preconditioned;  ///< z; may be the same memory as `product`
  std::span<Value> direction;       ///< p
  std::span<Value> product;         ///< A p
};

/// Takes at most `steps` steps. `precondition()` sets z to an approximation of A^-1 r, `multiply()`
/// sets the product to A p, and `advance(lengths)` adds lengths[i % width] * p to the solution.
/// Stops early if r . z falls to `settled` times its first value, or if rounding errors leave
/// nothing to be gained. Returns the first r . z of each system. Allocates no memory.
template <std::size_t width, class Value, class Precondition, class Multiply, class Advance>
std::array<double, width> conjugate_gradients(const ConjugateVectors<Value>& vectors, int steps,
                                              double settled, const Precondition& precondition,
                                              const Multiply& multiply, const Advance& advance) {
  using Numbers = std::array<double, width>;
  const std::size_t n = vectors.residual.size();
  const auto products = [n](std::span<const Value> a, std::span<const Value> b) {
    Numbers sums{};
    for (std::size_t i = 0; i < n; i += width) {
      for (std::size_t f = 0; f < width; ++f) sums[f] += dot(a[i + f], b[i + f]);
    }
    return sums;
  };
  const auto ratios = [](const Numbers& a, const Numbers& b) {
    Numbers quotients{};
    for (std::size_t f = 0; f < width; ++f) {
      const double quotient = b[f] > 0 ? a[f] / b[f] : 0;
      quotients[f] = std::isfinite(quotient) ? quotient : 0;
    }
    return quotients;
  };
  std::ranges::fill(vectors.direction, Value{});
  Numbers first{};
  Numbers last{};
  for (int step = 0; step < steps; ++step) {
    precondition();
    const Numbers slopes = products(vectors.residual, vectors.preconditioned);
    if (step == 0) first = slopes;
    bool is_settled = true;
    for (std::size_t f = 0; f < width; ++f) {
      is_settled = is_settled && !(slopes[f] > settled * first[f]);
    }
    if (is_settled) break;
    const Numbers kept = ratios(slopes, last);
    last = slopes;
    for (std::size_t i = 0; i < n; i += width) {
      for (std::size_t f = 0; f < width; ++f) {
        vectors.direction[i + f] =
            vectors.preconditioned[i + f] + kept[f] * vectors.direction[i + f];
      }
    }
    multiply();
    const Numbers lengths = ratios(slopes, products(vectors.direction, vectors.product));
    if (std::ranges::none_of(lengths, [](double length) { return length > 0; })) break;
    advance(lengths);
    for (std::size_t i = 0; i < n; i += width) {
      for (std::size_t f = 0; f < width; ++f) {
        vectors.residual[i + f] = vectors.residual[i + f] - lengths[f] * vectors.product[i + f];
      }
    }
  }
  return first;
}

}  // namespace dynmesh
