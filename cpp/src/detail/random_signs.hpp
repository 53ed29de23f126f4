/// Random signs that depend on nothing but a number, so that equal calls give equal signs.
#pragma once

#include <bit>
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

/// Random signs, which have variance 1 as normal numbers have, and cost a bit each.
class Signs {
 public:
  explicit Signs(std::uint64_t bits) : bits_(bits) {}
  Vector3<double> next() {
    const double x = one(), y = one(), z = one();
    return {x, y, z};
  }

 private:
  /// Sets the sign bit of 1, since a branch would be taken at random.
  double one() {
    constexpr std::uint64_t sign_bit = std::uint64_t{1} << 63;
    const std::uint64_t sign = bits_ & sign_bit;
    bits_ <<= 1;
    return std::bit_cast<double>(std::bit_cast<std::uint64_t>(1.0) | sign);
  }
  std::uint64_t bits_;
};

}  // namespace dynmesh
