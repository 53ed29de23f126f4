#include "kernels/processor.hpp"

#include <doctest/doctest.h>

#include <cstdint>

#include "kernels/kernels.hpp"

namespace dynmesh::testing {
namespace {

constexpr std::uint32_t bit(int number) { return std::uint32_t{1} << number; }

// The features of each level, listed independently of the implementation.
TEST_CASE("a processor has a level only if it has all of its features") {
  const ProcessorFeatures everything = {~0U, ~0U, ~0U, ~std::uint64_t{0}};
  CHECK(level_of(everything) == ProcessorLevel::v4);
  CHECK(level_of({}) == ProcessorLevel::baseline);

  // SSE3, SSSE3, FMA, CMPXCHG16B, SSE4.1, SSE4.2, MOVBE, POPCNT, OSXSAVE, AVX, F16C
  for (const int feature : {0, 9, 12, 13, 19, 20, 22, 23, 27, 28, 29}) {
    ProcessorFeatures lacking = everything;
    lacking.leaf_1_ecx &= ~bit(feature);
    CHECK(level_of(lacking) == ProcessorLevel::baseline);
  }
  for (const int lahf_lzcnt : {0, 5}) {
    ProcessorFeatures lacking = everything;
    lacking.leaf_80000001_ecx &= ~bit(lahf_lzcnt);
    CHECK(level_of(lacking) == ProcessorLevel::baseline);
  }
  for (const int bmi1_avx2_bmi2 : {3, 5, 8}) {
    ProcessorFeatures lacking = everything;
    lacking.leaf_7_ebx &= ~bit(bmi1_avx2_bmi2);
    CHECK(level_of(lacking) == ProcessorLevel::baseline);
  }
  for (const int xmm_ymm : {1, 2}) {
    ProcessorFeatures not_kept = everything;
    not_kept.xcr0 &= ~std::uint64_t{bit(xmm_ymm)};
    CHECK(level_of(not_kept) == ProcessorLevel::baseline);
  }
  for (const int avx512f_dq_cd_bw_vl : {16, 17, 28, 30, 31}) {
    ProcessorFeatures lacking = everything;
    lacking.leaf_7_ebx &= ~bit(avx512f_dq_cd_bw_vl);
    CHECK(level_of(lacking) == ProcessorLevel::v3);
  }
  for (const int opmask_upper_halves_of_zmm_zmm16_to_31 : {5, 6, 7}) {
    ProcessorFeatures not_kept = everything;
    not_kept.xcr0 &= ~std::uint64_t{bit(opmask_upper_halves_of_zmm_zmm16_to_31)};
    CHECK(level_of(not_kept) == ProcessorLevel::v3);
  }
}

TEST_CASE("no other features are required") {
  const ProcessorFeatures v3 = {bit(0) | bit(9) | bit(12) | bit(13) | bit(19) | bit(20) | bit(22) |
                                    bit(23) | bit(27) | bit(28) | bit(29),
                                bit(3) | bit(5) | bit(8), bit(0) | bit(5), 6};
  CHECK(level_of(v3) == ProcessorLevel::v3);
  const ProcessorFeatures v4 = {v3.leaf_1_ecx,
                                v3.leaf_7_ebx | bit(16) | bit(17) | bit(28) | bit(30) | bit(31),
                                v3.leaf_80000001_ecx, 0xe6};
  CHECK(level_of(v4) == ProcessorLevel::v4);
}

#if defined(__x86_64__) && !defined(__clang__) && __GNUC__ >= 12
TEST_CASE("the level of this processor agrees with the compiler") {
  const ProcessorLevel level = level_of(processor_features());
  CHECK((level >= ProcessorLevel::v4) == (__builtin_cpu_supports("x86-64-v4") != 0));
  CHECK((level >= ProcessorLevel::v3) == (__builtin_cpu_supports("x86-64-v3") != 0));
  CHECK(runnable_kernels().size() == static_cast<std::size_t>(level) + 1);
}
#endif

}  // namespace
}  // namespace dynmesh::testing
