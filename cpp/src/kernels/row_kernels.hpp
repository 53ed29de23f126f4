/// The inner loops that copy frames between the caller's packed rows and the internal arrays,
/// optimised for each kind of processor.
#pragma once

#include <dynmesh/types.hpp>

namespace dynmesh {

/// A frame in the caller's memory: packed rows of three Reals.
template <class Real>
struct PackedRows {
  Real* data;
  const Index* row_of;  // (k,) the row of each vertex, or null if rows are in the order of vertices
};

template <class Real>
struct RowKernels {
  /// Reads the vertices `first` to `last` - 1 into `points`. `observed` has a byte for each row; if
  /// it is null, finite rows are known. Returns whether all known rows are within `limit`.
  bool (*read)(const PackedRows<const Real>& rows, const std::uint8_t* observed, Real limit,
               Index first, Index last, Real* points, std::uint8_t* known);
  /// Writes these vertices. A vertex that is beyond `limit` or NaN is first reset to `previous`.
  void (*write)(Real* points, const Real* previous, Real limit, Index first, Index last,
                const PackedRows<Real>& rows);
};

}  // namespace dynmesh
