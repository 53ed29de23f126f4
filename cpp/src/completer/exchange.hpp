/// Between the caller's arrays and the frames that the method works on.
#pragma once

#include <dynmesh/types.hpp>
#include <span>

#include "kernels/kernels.hpp"
#include "mesh/numbering.hpp"
#include "support/workers.hpp"

namespace dynmesh {

/// Puts vertices in their places and back. Allocates nothing. Packed rows take the fast way.
template <class Real>
class Exchange {
 public:
  /// Both must outlive this object.
  Exchange(const Numbering& numbering, Workers& workers);

  /// Takes every row to its place and notes which are known: those of the mask, or without one
  /// (`known.data` null) the finite ones. Returns whether all known ones are in range; others are
  /// taken all the same.
  bool read(Points<const Real> rows, KnownMask known, std::span<Vector3<Real>> points,
            std::span<std::uint8_t> is_known);

  /// The other way; points that are not in range first go back to where they were.
  void write(std::span<Vector3<Real>> points, std::span<const Vector3<Real>> previous,
             Points<Real> rows);

 private:
  const Numbering& numbering_;
  Workers& workers_;
  const RowKernels<Real>& kernels_;
};

}  // namespace dynmesh
