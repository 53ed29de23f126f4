/// The inner loops between the caller's packed rows and frames in memory of our own, as fast as the
/// processor allows.
#pragma once

#include <dynmesh/types.hpp>
#include <vector>

namespace dynmesh {

/// A frame in the caller's memory: packed rows of three Reals.
template <class Real>
struct PackedRows {
  Real* data;
  const Index* row_of;  // (k,) the row of each vertex, or null where that is its number
};

template <class Real>
struct RowKernels {
  /// Reads the vertices from `first` to `last` into `points`. `observed` has a byte for each row;
  /// if null, the rows that are finite are known. Returns whether all known ones lie within
  /// `limit`.
  bool (*read)(const PackedRows<const Real>& rows, const std::uint8_t* observed, Real limit,
               Index first, Index last, Real* points, std::uint8_t* known);
  /// Writes them. A vertex beyond `limit`, or not a number, first goes back to `previous`.
  void (*write)(Real* points, const Real* previous, Real limit, Index first, Index last,
                const PackedRows<Real>& rows);
};

/// Those that this processor runs, the fastest first.
template <class Real>
std::vector<const RowKernels<Real>*> runnable_row_kernels();

}  // namespace dynmesh
