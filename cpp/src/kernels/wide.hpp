/// The widest vectors of the processor, and quads at any address; see lanes.hpp.
#pragma once

#include "kernels/lanes.hpp"

namespace dynmesh::DYNMESH_KERNELS {
namespace {

using Doubles = Quad<double>;
using Unaligned [[gnu::vector_size(32), gnu::may_alias, gnu::aligned(8)]] = double;

[[gnu::always_inline]] inline Doubles load(const double* from) {
  return *reinterpret_cast<const Unaligned*>(from);
}
[[gnu::always_inline]] inline void store(double* to, Doubles value) {
  *reinterpret_cast<Unaligned*>(to) = value;
}

#ifdef __AVX512F__
constexpr int lanes = 8;
#else
constexpr int lanes = 4;
#endif
using Wide [[gnu::vector_size(8 * lanes), gnu::may_alias, gnu::aligned(8)]] = double;

[[gnu::always_inline]] inline Wide& wide(double* numbers) {
  return *reinterpret_cast<Wide*>(numbers);
}
[[gnu::always_inline]] inline const Wide& wide(const double* numbers) {
  return *reinterpret_cast<const Wide*>(numbers);
}

}  // namespace
}  // namespace dynmesh::DYNMESH_KERNELS
