#include "kernels/kernels.hpp"

#include "kernels/processor.hpp"

namespace dynmesh {

// The files that define these are compiled once for each name: see lanes.hpp.
#define DYNMESH_DECLARE_KERNELS(name)                                        \
  namespace name {                                                           \
  extern const BlockKernels block_kernels;                                   \
  extern const DenseKernels dense_kernels;                                   \
  extern const ModeKernels mode_kernels;                                     \
  extern const OperatorKernels operator_kernels;                             \
  extern const RotationKernels rotation_kernels;                             \
  extern const RowKernels<float> row_kernels_of_floats;                      \
  extern const RowKernels<double> row_kernels_of_doubles;                    \
  extern const Sweeps<float> sweeps_of_floats;                               \
  extern const Sweeps<double> sweeps_of_doubles;                             \
  static Kernels kernels() {                                                 \
    return {block_kernels,          dense_kernels,    mode_kernels,          \
            operator_kernels,       rotation_kernels, row_kernels_of_floats, \
            row_kernels_of_doubles, sweeps_of_floats, sweeps_of_doubles};    \
  }                                                                          \
  }
#ifdef DYNMESH_X86_64
DYNMESH_DECLARE_KERNELS(x86_64_v3)
DYNMESH_DECLARE_KERNELS(x86_64_v4)
#endif
DYNMESH_DECLARE_KERNELS(portable)
#undef DYNMESH_DECLARE_KERNELS

const std::vector<Kernels>& runnable_kernels() {
  static const std::vector<Kernels> runnable = [] {
    std::vector<Kernels> found;
#ifdef DYNMESH_X86_64
    const ProcessorLevel level = level_of(processor_features());
    if (level >= ProcessorLevel::v4) found.push_back(x86_64_v4::kernels());
    if (level >= ProcessorLevel::v3) found.push_back(x86_64_v3::kernels());
#endif
    found.push_back(portable::kernels());
    return found;
  }();
  return runnable;
}

}  // namespace dynmesh
