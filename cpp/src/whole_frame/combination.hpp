/// The mean of what the trips to both sides found, and how far it may be off.
#pragma once

#include <cstdint>
#include <dynmesh/topology.hpp>
#include <dynmesh/types.hpp>
#include <span>
#include <vector>

#include "whole_frame/constants.hpp"
#include "whole_frame/trips.hpp"

namespace dynmesh {

/// The weighted mean of the sides, y = sum of w_q y_q.
struct Combination {
  std::vector<Vector3<double>> positions;
  std::vector<double> disagreement;    ///< D: the mean of |y_q - y|^2 / 3
  std::vector<double> error_of_sides;  ///< S: the mean of s_q^2, infinity where all are
};

/// The weights w_q are proportional to 1 / (s_q^2 (a_q + 0.1)), where s_q is the standard error and
/// a_q the age; a millionth of that if the vertex was never seen on that side, and equal where no
/// side is better. `results` must not be empty.
Combination combine(std::span<const SideResult> results, const WholeFrameConstants& constants);

/// (k,) the standard errors of a combination, of vertices that are neither known nor disconnected:
/// 0.92 sqrt(0.3 S + D) sqrt(r) (1 + 2 / min(u, 20)), where r is the number of edges to the nearest
/// vertex that the frame knows, and u that to the nearest one that no frame knows, 20 if there is
/// none. For such a vertex itself, it is at least 2.5 times that, and at least
/// 0.5 h min(r', 6)^0.85, where h is the typical length of an edge and r' the number of edges to
/// the nearest vertex that any frame knows. Infinity for disconnected vertices. Known vertices have
/// 0, or with noise the root of S.
std::vector<double> standard_errors(const Combination& combination, const Cells& cells,
                                    std::span<const std::uint8_t> known,
                                    std::span<const std::uint8_t> seen, double typical_length,
                                    bool has_noise, const WholeFrameConstants& constants);

}  // namespace dynmesh
