/// The inner loops of products with K and with rotations, optimised for each kind of processor; see
/// dense_kernels.hpp.
///
/// Fields have one or three Vector3 for each vertex, side by side. Three fields together take much
/// less time than three separate ones, since the matrix is read only once.
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
  /// Computes rows `first` to `last` - 1 of K x.
  void (*apply)(const OperatorData& k, const Vector3<double>* x, int fields,
                Vector3<double>* products, Index first, Index last);

  /// Sets row n of `products` to row rows[n] of C y, which is K^T r for y = M^-1/2 r, for n =
  /// `first` to `last` - 1.
  void (*apply_transposed)(const OperatorData& k, const Vector3<double>* y, int fields,
                           const Index* rows, Vector3<double>* products, Index first, Index last);

  /// Rotates rows `first` to `last` - 1 of one or three fields.
  void (*turn)(const Quaternion* rotations, const Vector3<double>* values, int fields,
               Vector3<double>* turned, Index first, Index last);
  /// Rotates rows of one field by the inverse rotations.
  void (*turn_back)(const Quaternion* rotations, const Vector3<double>* field,
                    Vector3<double>* turned, Index first, Index last);
};

}  // namespace dynmesh
