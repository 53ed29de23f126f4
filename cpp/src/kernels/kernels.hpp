/// The inner loops, compiled once for each kind of processor, and the choice among them.
#pragma once

#include <vector>

#include "kernels/block_kernels.hpp"
#include "kernels/dense_kernels.hpp"
#include "kernels/mode_kernels.hpp"
#include "kernels/rotation_kernels.hpp"
#include "kernels/sweeps.hpp"

namespace dynmesh {

/// All inner loops for one kind of processor.
struct Kernels {
  BlockKernels blocks;
  DenseKernels dense;
  ModeKernels modes;
  OperatorKernels products;
  RotationKernels rotations;
  RowKernels<float> rows_of_floats;
  RowKernels<double> rows_of_doubles;
  Sweeps<float> sweeps_of_floats;
  Sweeps<double> sweeps_of_doubles;

  template <class Real>
  [[nodiscard]] const RowKernels<Real>& rows() const {
    if constexpr (sizeof(Real) == sizeof(float)) {
      return rows_of_floats;
    } else {
      return rows_of_doubles;
    }
  }
  template <class Real>
  [[nodiscard]] const Sweeps<Real>& sweeps() const {
    if constexpr (sizeof(Real) == sizeof(float)) {
      return sweeps_of_floats;
    } else {
      return sweeps_of_doubles;
    }
  }
};

/// Those that this processor can run, the fastest first.
const std::vector<Kernels>& runnable_kernels();

/// The fastest that this processor can run.
inline const Kernels& best_kernels() { return runnable_kernels().front(); }

}  // namespace dynmesh
