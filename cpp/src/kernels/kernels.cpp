#include "kernels/kernels.hpp"

#include <bit>

namespace dynmesh {

// Nobody has run dynmesh on others: frames in files and states have the byte order of memory, and
// the memory of 32-bit processors is too small for the sizes that are allowed.
static_assert(std::endian::native == std::endian::little,
              "dynmesh requires a little-endian processor");
static_assert(sizeof(void*) == 8, "dynmesh requires a 64-bit processor");

// The files that define these are compiled once for each name: see lanes.hpp.
#define DYNMESH_DECLARE_KERNELS(name)                                    \
  namespace name {                                                       \
  extern const DenseKernels dense_kernels;                               \
  extern const RotationKernels rotation_kernels;                         \
  static Kernels kernels() { return {dense_kernels, rotation_kernels}; } \
  }
#ifdef DYNMESH_X86_64
DYNMESH_DECLARE_KERNELS(avx2)
#endif
DYNMESH_DECLARE_KERNELS(portable)
#undef DYNMESH_DECLARE_KERNELS

const std::vector<Kernels>& runnable_kernels() {
  static const std::vector<Kernels> runnable = [] {
    std::vector<Kernels> found;
#ifdef DYNMESH_X86_64
    __builtin_cpu_init();
    if (__builtin_cpu_supports("avx2") && __builtin_cpu_supports("fma") &&
        __builtin_cpu_supports("bmi") && __builtin_cpu_supports("bmi2")) {
      found.push_back(avx2::kernels());
    }
#endif
    found.push_back(portable::kernels());
    return found;
  }();
  return runnable;
}

}  // namespace dynmesh
