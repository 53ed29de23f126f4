/// Measures of the error of a completed frame (paper, section 4, "Metrics").
#pragma once

#include <dynmesh/export.hpp>
#include <dynmesh/topology.hpp>
#include <dynmesh/types.hpp>
#include <span>

namespace dynmesh {

/// Normalised mean square visual error, eq. (5) and (6), in the unit of the positions:
///
/// 1/(2k) sum over i of |v_i - v'_i| + |GL(v_i) - GL(v'_i)|
///
/// GL(v_i) is v_i minus the mean of its cell weighted by inverse distance, or 0 if the cell is
/// empty. Distances are measured on the respective mesh and are at least 1e-6 mean edge lengths of
/// the reference. The time is linear in the number of edges.
///
/// Throws std::invalid_argument unless `reference` and `completed` have one finite row per cell,
/// within the range of Completer.
template <class Real>
DYNMESH_EXPORT double nmsve(const Cells& cells, Points<const Real> reference,
                            Points<const Real> completed);

/// Computes |v_i - v'_i| of each vertex, which the paper shows as heatmaps, in the unit of the
/// positions. Throws std::invalid_argument unless all arguments have the same number of rows and
/// all positions are finite.
template <class Real>
DYNMESH_EXPORT void vertex_error(Points<const Real> reference, Points<const Real> completed,
                                 std::span<double> error);

}  // namespace dynmesh
