/// The inner loops of method motion, optimised for each kind of processor; see kernels.hpp.
#pragma once

#include <dynmesh/types.hpp>

namespace dynmesh {

/// The unknown vertices of a chunk, in the order of their weights s.
struct MotionRows {
  const Index* offsets;     ///< of the cells
  const Index* neighbours;  ///< of the cells
  const Index* rows;
  Index n;
};

/// Motions are quads: that of a vertex times its weight w / t, and this weight.
struct MotionKernels {
  /// Sets the weights s_ij = 1 / |v_i - v_j|^2 of all cells, where `scale` is 1 / h.
  void (*weigh)(const MotionRows& rows, const Vector3* previous, double scale, double* weights);
  /// Sets the means (4) of the motions in the cells, times their weight in iteration t + 1, and the
  /// generation of vertices that are reached first. Without `revisits`, vertices that were reached
  /// before keep theirs. Returns the number of those that are reached.
  Index (*find_means)(const MotionRows& rows, const double* weights, const double* moved, Index t,
                      bool revisits, double* means, Index* generation);
};

}  // namespace dynmesh
