/// Random signs that depend on nothing but a number, so that equal calls give equal signs.
#pragma once

#include <bit>
#include <cstddef>
#include <cstdint>
#include <dynmesh/types.hpp>

namespace dynmesh {

/// The output function of SplitMix64 (Steele, Lea and Flood 2014): a different, seemingly random
/// number for every x.
constexpr std::uint64_t mixed(std::uint64_t x) {
  x += 0x9e3779b97f4a7c15ULL;
  x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9ULL;
  x = (x ^ (x >> 27)) * 0x94d049bb133111ebULL;
  return x ^ (x >> 31);
}

/// The signs of three of the bits, which have variance 1 as normal numbers have: for i = 0, 1, ...
/// the first three, the next three, and so on. Sets the sign bit of 1, since a branch would be
/// taken at random.
inline Vector3 signs_of(std::uint64_t bits, std::size_t i) {
  const auto sign = [bits](std::size_t bit) {
    constexpr std::uint64_t sign_bit = std::uint64_t{1} << 63;
    return std::bit_cast<double>(std::bit_cast<std::uint64_t>(1.0) | ((bits << bit) & sign_bit));
  };
  return {sign(3 * i), sign(3 * i + 1), sign(3 * i + 2)};
}

}  // namespace dynmesh
