#include "kernels/dense_kernels.hpp"
#include "kernels/operator_kernels.hpp"
#include "kernels/processor.hpp"
#include "kernels/rotation_kernels.hpp"
#include "kernels/row_kernels.hpp"
#include "kernels/sweeps.hpp"

namespace dynmesh {

#define DYNMESH_DECLARE_KERNELS(name)                     \
  namespace name {                                        \
  extern const DenseKernels dense_kernels;                \
  extern const OperatorKernels operator_kernels;          \
  extern const RotationKernels rotation_kernels;          \
  extern const RowKernels<float> row_kernels_of_floats;   \
  extern const RowKernels<double> row_kernels_of_doubles; \
  extern const Sweeps<float> sweeps_of_floats;            \
  extern const Sweeps<double> sweeps_of_doubles;          \
  }
#ifdef DYNMESH_X86_64
DYNMESH_DECLARE_KERNELS(x86_64_v2)
DYNMESH_DECLARE_KERNELS(x86_64_v3)
#endif
DYNMESH_DECLARE_KERNELS(portable)

namespace {

[[maybe_unused]] ProcessorLevel level_of_this_processor() {
  static const ProcessorLevel level =
      level_of(processor_features());  // CPUID is slow in a virtual machine
  return level;
}

/// Returns the kernels that this processor can run, the fastest first.
template <class Kernels>
std::vector<const Kernels*> runnable([[maybe_unused]] const Kernels* v3,
                                     [[maybe_unused]] const Kernels* v2, const Kernels* portable) {
  std::vector<const Kernels*> found;
#ifdef DYNMESH_X86_64
  const ProcessorLevel level = level_of_this_processor();
  if (level >= ProcessorLevel::v3) found.push_back(v3);
  if (level >= ProcessorLevel::v2) found.push_back(v2);
#endif
  found.push_back(portable);
  return found;
}

}  // namespace

#ifdef DYNMESH_X86_64
#define DYNMESH_RUNNABLE(kernels) \
  runnable(&x86_64_v3::kernels, &x86_64_v2::kernels, &portable::kernels)
#else
#define DYNMESH_RUNNABLE(kernels) runnable({}, {}, &portable::kernels)
#endif

std::vector<const DenseKernels*> runnable_dense_kernels() {
  return DYNMESH_RUNNABLE(dense_kernels);
}

std::vector<const OperatorKernels*> runnable_operator_kernels() {
  return DYNMESH_RUNNABLE(operator_kernels);
}

std::vector<const RotationKernels*> runnable_rotation_kernels() {
  return DYNMESH_RUNNABLE(rotation_kernels);
}

template <>
std::vector<const RowKernels<float>*> runnable_row_kernels() {
  return DYNMESH_RUNNABLE(row_kernels_of_floats);
}

template <>
std::vector<const RowKernels<double>*> runnable_row_kernels() {
  return DYNMESH_RUNNABLE(row_kernels_of_doubles);
}

template <>
std::vector<const Sweeps<float>*> runnable_sweeps() {
  return DYNMESH_RUNNABLE(sweeps_of_floats);
}

template <>
std::vector<const Sweeps<double>*> runnable_sweeps() {
  return DYNMESH_RUNNABLE(sweeps_of_doubles);
}

}  // namespace dynmesh
