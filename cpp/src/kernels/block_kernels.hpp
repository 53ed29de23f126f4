/// Products of small matrices in single precision and vectors in double precision: the inner loops
/// of solving with a rounded factor.
///
/// A matrix (n, columns) in blocks has `rows_of_block` rows in each block, which is stored column
/// by column. The rows that the last block has in excess are 0.
#pragma once

#include <dynmesh/types.hpp>

namespace dynmesh {

constexpr Index rows_of_block = 8;

struct BlockKernels {
  /// Subtracts the product of a matrix and the quads `x` (columns,) from the quads `rows` (n,) of
  /// `values`.
  void (*subtract)(const float* blocks, Index n, Index columns, const double* x, const Index* rows,
                   double* values);
  /// Subtracts the product of the transposed matrix and those quads of `values` from `x`.
  void (*subtract_transposed)(const float* blocks, Index n, Index columns, double* x,
                              const Index* rows, const double* values);
};

}  // namespace dynmesh
