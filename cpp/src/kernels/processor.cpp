#include "kernels/processor.hpp"

#include <bit>
#include <initializer_list>

#if defined(__x86_64__)
#include <cpuid.h>
#endif

// Nobody has run dynmesh on others: frames in files have the byte order of memory, and the memory
// of 32-bit processors is too small for the sizes that are allowed.
static_assert(std::endian::native == std::endian::little,
              "dynmesh requires a little-endian processor");
static_assert(sizeof(void*) == 8, "dynmesh requires a 64-bit processor");

namespace dynmesh {
namespace {

constexpr std::uint32_t bits(std::initializer_list<int> numbers) {
  std::uint32_t set = 0;
  for (const int number : numbers) set |= std::uint32_t{1} << number;
  return set;
}

constexpr bool has(std::uint64_t found, std::uint64_t wanted) { return (found & wanted) == wanted; }

// Bit numbers from the manuals of Intel and AMD.
constexpr std::uint32_t osxsave = bits({27});  // XGETBV may be used
// SSE3, SSSE3, FMA, CMPXCHG16B, SSE4.1, SSE4.2, MOVBE, POPCNT, AVX, F16C
constexpr std::uint32_t v3_leaf_1 = osxsave | bits({0, 9, 12, 13, 19, 20, 22, 23, 28, 29});
constexpr std::uint32_t v3_leaf_7 = bits({3, 5, 8});             // BMI1, AVX2, BMI2
constexpr std::uint32_t v3_leaf_80000001 = bits({0, 5});         // LAHF and SAHF, LZCNT
constexpr std::uint32_t v4_leaf_7 = bits({16, 17, 28, 30, 31});  // AVX-512 F, DQ, CD, BW, VL
constexpr std::uint64_t sse_and_avx_registers = bits({1, 2});
constexpr std::uint64_t avx_512_registers = bits({5, 6, 7});

}  // namespace

ProcessorLevel level_of(const ProcessorFeatures& features) {
  const bool is_v3 = has(features.leaf_1_ecx, v3_leaf_1) && has(features.leaf_7_ebx, v3_leaf_7) &&
                     has(features.leaf_80000001_ecx, v3_leaf_80000001) &&
                     has(features.xcr0, sse_and_avx_registers);
  if (!is_v3) return ProcessorLevel::baseline;
  const bool is_v4 = has(features.leaf_7_ebx, v4_leaf_7) && has(features.xcr0, avx_512_registers);
  return is_v4 ? ProcessorLevel::v4 : ProcessorLevel::v3;
}

// __builtin_cpu_supports is not used, since Clang 14 supports neither the levels nor all of their
// features.
ProcessorFeatures processor_features() {
  ProcessorFeatures features;
#if defined(__x86_64__)
  // If the processor does not have a leaf, its registers stay 0.
  std::uint32_t eax = 0;
  std::uint32_t ebx = 0;
  std::uint32_t ecx = 0;
  std::uint32_t edx = 0;
  if (__get_cpuid(1, &eax, &ebx, &ecx, &edx) != 0) features.leaf_1_ecx = ecx;
  if (__get_cpuid_count(7, 0, &eax, &ebx, &ecx, &edx) != 0) features.leaf_7_ebx = ebx;
  if (__get_cpuid(0x80000001, &eax, &ebx, &ecx, &edx) != 0) features.leaf_80000001_ecx = ecx;
  if (has(features.leaf_1_ecx, osxsave)) {
    std::uint32_t low = 0;
    std::uint32_t high = 0;
    __asm__ volatile("xgetbv" : "=a"(low), "=d"(high) : "c"(0));
    features.xcr0 = std::uint64_t{high} << 32 | low;
  }
#endif
  return features;
}

}  // namespace dynmesh
