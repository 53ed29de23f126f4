/// What kind of x86-64 processor this is, by the levels of its psABI, which -march=x86-64-v2 and
/// -v3 compile for.
#pragma once

#include <cstdint>

namespace dynmesh {

enum class ProcessorLevel { baseline, v2, v3 };

/// What a processor says of itself: registers after the instructions CPUID, with the leaf in eax,
/// and XGETBV.
struct ProcessorFeatures {
  std::uint32_t leaf_1_ecx = 0;
  std::uint32_t leaf_7_ebx = 0;
  std::uint32_t leaf_80000001_ecx = 0;
  std::uint64_t xcr0 = 0;  ///< the registers that the operating system keeps
};

/// The highest level of which the processor has everything: the compiler may use any of it.
ProcessorLevel level_of(const ProcessorFeatures& features);

/// Of the processor that this runs on; nothing where it is not of x86-64.
ProcessorFeatures processor_features();

}  // namespace dynmesh
