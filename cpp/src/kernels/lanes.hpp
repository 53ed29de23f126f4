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

using Doubles [[gnu::vector_size(32), gnu::may_alias]] = double;
using Integers [[gnu::vector_size(32), gnu::may_alias]] = std::int64_t;
constexpr int lanes = 4;

[[gnu::always_inline]] inline Doubles quad(const Vector3* v) {
  return *reinterpret_cast<const Doubles*>(v);
}
[[gnu::always_inline]] inline Doubles& quad(Vector3* v) { return *reinterpret_cast<Doubles*>(v); }

/// Quads at any address.
using AtAnyAddress [[gnu::vector_size(32), gnu::may_alias, gnu::aligned(8)]] = double;
[[gnu::always_inline]] inline Doubles load(const double* from) {
  return *reinterpret_cast<const AtAnyAddress*>(from);
}
[[gnu::always_inline]] inline void store(double* to, Doubles value) {
  *reinterpret_cast<AtAnyAddress*>(to) = value;
}

using Floats [[gnu::vector_size(16), gnu::may_alias, gnu::aligned(4)]] = float;
[[gnu::always_inline]] inline Floats load(const float* from) {
  return *reinterpret_cast<const Floats*>(from);
}
[[gnu::always_inline]] inline void store(float* to, Floats value) {
  *reinterpret_cast<Floats*>(to) = value;
}

[[gnu::always_inline]] inline Doubles larger(Doubles a, Doubles b) { return a > b ? a : b; }

}  // namespace
}  // namespace dynmesh::DYNMESH_KERNELS
