/// Preconditioned conjugate gradients (Hestenes and Stiefel 1952), for a few steps.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <span>

#include "base/geometry.hpp"
#include "base/workers.hpp"

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
/// nothing to be gained. Returns the first r . z of each system. `workers` share the vectors, with
/// the same result for any number of threads. Allocates no memory.
template <std::size_t width, class Value, class Precondition, class Multiply, class Advance>
std::array<double, width> conjugate_gradients(const ConjugateVectors<Value>& vectors, int steps,
                                              double settled, const Precondition& precondition,
                                              const Multiply& multiply, const Advance& advance,
                                              Workers& workers) {
  using Numbers = std::array<double, width>;
  constexpr std::size_t pieces = 32;  // always the same, so that sums do not depend on threads
  const std::size_t rows = vectors.residual.size() / width;
  const auto for_each = [&](const auto& work) {
    workers.share(pieces, workers.are_worth_it(static_cast<Index>(rows)), [&](Index piece) {
      const auto p = static_cast<std::size_t>(piece);
      for (std::size_t i = rows * p / pieces * width; i < rows * (p + 1) / pieces * width; ++i) {
        work(p, i, i % width);
      }
    });
  };
  const auto products = [&](std::span<const Value> a, std::span<const Value> b) {
    std::array<Numbers, pieces> parts{};
    for_each([&](std::size_t p, std::size_t i, std::size_t f) { parts[p][f] += dot(a[i], b[i]); });
    Numbers sums{};
    for (const Numbers& part : parts) {
      for (std::size_t f = 0; f < width; ++f) sums[f] += part[f];
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
    for_each([&](std::size_t, std::size_t i, std::size_t f) {
      vectors.direction[i] = vectors.preconditioned[i] + kept[f] * vectors.direction[i];
    });
    multiply();
    const Numbers lengths = ratios(slopes, products(vectors.direction, vectors.product));
    if (std::ranges::none_of(lengths, [](double length) { return length > 0; })) break;
    advance(lengths);
    for_each([&](std::size_t, std::size_t i, std::size_t f) {
      vectors.residual[i] = vectors.residual[i] - lengths[f] * vectors.product[i];
    });
  }
  return first;
}

}  // namespace dynmesh
