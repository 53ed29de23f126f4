/// The inner loops, compiled once for each kind of processor, and the choice among them.
#pragma once

#include <vector>

#include "kernels/dense_kernels.hpp"
#include "kernels/rotation_kernels.hpp"

namespace dynmesh {

/// All inner loops for one kind of processor.
struct Kernels {
  DenseKernels dense;
  RotationKernels rotations;
};

/// The kernels that this processor can run, the fastest first.
const std::vector<Kernels>& runnable_kernels();

/// The fastest kernels that this processor can run.
inline const Kernels& best_kernels() { return runnable_kernels().front(); }

}  // namespace dynmesh
