/// Copies frames between the caller's arrays and the internal arrays.
#pragma once

#include <dynmesh/types.hpp>
#include <span>

#include "kernels/kernels.hpp"
#include "mesh/numbering.hpp"
#include "support/workers.hpp"

namespace dynmesh {

/// Converts between the caller's order of vertices and the internal order. Allocates no memory.
/// Packed rows are processed by faster loops.
template <class Real>
class Exchange {
 public:
  /// Both arguments must outlive this object.
  Exchange(const Numbering& numbering, Workers& workers);

  /// Copies every row to `points` and sets `is_known` according to the mask or, if `known.data` is
  /// null, for finite rows. Returns whether all known rows are in range; rows that are not are
  /// copied as well.
  bool read(Points<const Real> rows, KnownMask known, std::span<Vector3<Real>> points,
            std::span<std::uint8_t> is_known);

  /// Copies the completed points to the caller's rows. Points that are out of range are first reset
  /// to their previous positions.
  void write(std::span<Vector3<Real>> points, std::span<const Vector3<Real>> previous,
             Points<Real> rows);

 private:
  const Numbering& numbering_;
  Workers& workers_;
  const RowKernels<Real>& kernels_;
};

}  // namespace dynmesh
