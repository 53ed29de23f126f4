/// Measures and judges how a surface lies in a scan.
#pragma once

#include <cstdint>
#include <dynmesh/quality.hpp>
#include <dynmesh/topology.hpp>
#include <dynmesh/types.hpp>
#include <span>

#include "surface_fit/surface_matcher.hpp"

namespace dynmesh {

/// How many times as long the edges have become, by their median; 1 if there are none.
double growth_of(const Cells& cells, Field before, Field after);

/// How the points and the edges agree with a surface X (k,), of which some vertices are observed.
/// Only far points count as unexplained, hole and overlap are 0, and the quality is not judged.
Measure measured(const Agreement& agreement, std::span<const std::uint8_t> observed,
                 const Cells& cells, Field first_frame, Field x);

/// The share of the points that are farther from the surface than their noise, after
/// `update_distances`. `far_share` of them are far.
double unexplained_share(const MatchedPoints& points, double far_share);

Quality judged(const Measure& measure);

}  // namespace dynmesh
