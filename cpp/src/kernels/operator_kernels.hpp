/// The inner loops of products with K and with rotations, as fast as the processor allows; see
/// dense_kernels.hpp.
///
/// Fields are rows of one or three Vector3 for each vertex: side by side, three cost much less
/// than three times one, as the matrix is read once.
#pragma once

#include <dynmesh/types.hpp>

#include "kernels/rotation_kernels.hpp"

namespace dynmesh {

/// K = M^-1/2 C; see detail_operator.hpp.
struct OperatorData {
  const Index* offsets;
  const Index* columns;
  const double* values;
  const double* scale;
};

struct OperatorKernels {
  /// Rows `first` to `last` - 1 of K x.
  void (*apply)(const OperatorData& k, const Vector3<double>* x, int fields,
                Vector3<double>* products, Index first, Index last);

  /// Row n of `products` is row rows[n] of C y, which is K^T r for y = M^-1/2 r; n = `first` to
  /// `last` - 1.
  void (*apply_transposed)(const OperatorData& k, const Vector3<double>* y, int fields,
                           const Index* rows, Vector3<double>* products, Index first, Index last);

  /// Rotates rows `first` to `last` - 1 of three fields each.
  void (*turn)(const Quaternion* rotations, const Vector3<double>* triples, Vector3<double>* turned,
               Index first, Index last);
  /// Rotates them back, one field each.
  void (*turn_back)(const Quaternion* rotations, const Vector3<double>* field,
                    Vector3<double>* turned, Index first, Index last);
};

}  // namespace dynmesh
