/// Vectors of four numbers for the inner loops.
///
/// This header and the files that include it are compiled several times with different
/// instructions, each time in a namespace of its own; kernels.cpp selects which to run.
/// Nothing in them may also be instantiated elsewhere, since the linker might then choose the wrong
/// version. Templates and inline functions of the standard library are
/// therefore not used.
#pragma once

#include <dynmesh/types.hpp>

#ifndef DYNMESH_KERNELS
#define DYNMESH_KERNELS portable
#endif

namespace dynmesh::DYNMESH_KERNELS {
namespace {

template <class Real>
struct Lanes;
template <>
struct Lanes<float> {
  using Quad [[gnu::vector_size(16), gnu::may_alias]] = float;
  using Bits [[gnu::vector_size(16), gnu::may_alias]] = std::int32_t;
};
template <>
struct Lanes<double> {
  using Quad [[gnu::vector_size(32), gnu::may_alias]] = double;
  using Bits [[gnu::vector_size(32), gnu::may_alias]] = std::int64_t;
};
template <class Real>
using Quad = typename Lanes<Real>::Quad;
template <class Real>
using Bits = typename Lanes<Real>::Bits;
using Floats = Quad<float>;
using Doubles = Quad<double>;
constexpr int lanes = 4;

[[gnu::always_inline]] inline Doubles quad(const Vector3<double>* v) {
  return *reinterpret_cast<const Doubles*>(v);
}
[[gnu::always_inline]] inline Doubles& quad(Vector3<double>* v) {
  return *reinterpret_cast<Doubles*>(v);
}

/// Quads at any address.
using AtAnyAddress [[gnu::vector_size(32), gnu::may_alias, gnu::aligned(8)]] = double;
[[gnu::always_inline]] inline Doubles load(const double* from) {
  return *reinterpret_cast<const AtAnyAddress*>(from);
}
[[gnu::always_inline]] inline void store(double* to, Doubles value) {
  *reinterpret_cast<AtAnyAddress*>(to) = value;
}

template <class Real>
[[gnu::always_inline]] inline const Quad<Real>& quad(const Real* quads, std::uint32_t offset) {
  return *reinterpret_cast<const Quad<Real>*>(reinterpret_cast<const char*>(quads) + offset);
}
template <class Real>
[[gnu::always_inline]] inline Quad<Real>& quad_of(Real* quads, Index vertex) {
  return reinterpret_cast<Quad<Real>*>(quads)[vertex];
}
template <class Real>
[[gnu::always_inline]] inline const Quad<Real>& quad_of(const Real* quads, Index vertex) {
  return reinterpret_cast<const Quad<Real>*>(quads)[vertex];
}
template <int lane, class Vector>
[[gnu::always_inline]] inline Vector spread(Vector v) {
  return __builtin_shufflevector(v, v, lane, lane, lane, lane);
}
template <class Vector>
[[gnu::always_inline]] inline Vector larger(Vector a, Vector b) {
  return a > b ? a : b;
}

/// Returns all ones in the lanes whose magnitude is at most `limit`, and zero in the others and for
/// NaN.
template <class Real>
[[gnu::always_inline]] inline Bits<Real> within(Quad<Real> v, Real limit) {
  // Clear the sign bit.
  const Bits<Real> bits =
      reinterpret_cast<Bits<Real>>(v) & ~reinterpret_cast<Bits<Real>>(-Quad<Real>{});
  return reinterpret_cast<Quad<Real>>(bits) <= limit;
}

}  // namespace
}  // namespace dynmesh::DYNMESH_KERNELS
