/// Determines the level of an x86-64 processor as defined by the psABI, for which -march=x86-64-v3
/// and -v4 compile.
#pragma once

#include <cstdint>

namespace dynmesh {

enum class ProcessorLevel { baseline, v3, v4 };

/// The features of a processor: registers after the instructions CPUID, with the leaf in eax, and
/// XGETBV.
struct ProcessorFeatures {
  std::uint32_t leaf_1_ecx = 0;
  std::uint32_t leaf_7_ebx = 0;
  std::uint32_t leaf_80000001_ecx = 0;
  std::uint64_t xcr0 = 0;  ///< the registers that the operating system saves
};

/// Returns the highest level all of whose features are present, since the compiler may use any of
/// them.
ProcessorLevel level_of(const ProcessorFeatures& features);

/// Returns the features of this processor, or none if it is not x86-64.
ProcessorFeatures processor_features();

}  // namespace dynmesh
