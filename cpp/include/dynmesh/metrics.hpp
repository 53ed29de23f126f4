/// How far a completed frame is from the truth (paper, section 4, "Metrics").
#pragma once

#include <dynmesh/export.hpp>
#include <dynmesh/topology.hpp>
#include <dynmesh/types.hpp>
#include <span>

namespace dynmesh {

/// Normalised mean square visual error, eq. (5) and (6), in the unit of the positions:
/// 1/(2k) sum over i of |v_i - v'_i| + |GL(v_i) - GL(v'_i)|, with GL(v_i) = v_i less the mean of
/// its cell weighted by inverse distance, and 0 for an empty cell. Distances are measured on the
/// mesh in question and floored at 1e-6 mean edges of the reference. Linear in the edges.
///
/// `reference` and `completed` hold one finite row per cell; else std::invalid_argument.
template <class Real>
DYNMESH_EXPORT double nmsve(const Cells& cells, Points<const Real> reference,
                            Points<const Real> completed);

/// |v_i - v'_i| of each vertex, the paper's heatmap, in the unit of the positions. All three hold
/// the same number of rows, finite ones; else std::invalid_argument.
template <class Real>
DYNMESH_EXPORT void vertex_error(Points<const Real> reference, Points<const Real> completed,
                                 std::span<double> error);

/// In the unit of the errors.
struct ErrorSummary {
  double mean = 0;
  double rms = 0;  ///< root mean square
  double p99 = 0;  ///< 99th percentile, interpolated between the two nearest errors
  double maximum = 0;
};

/// `errors` must not be empty nor hold NaN; else std::invalid_argument.
DYNMESH_EXPORT ErrorSummary summary(std::span<const double> errors);

}  // namespace dynmesh
