/// Measures and judges how a surface lies in a scan.
#pragma once

#include <dynmesh/quality.hpp>
#include <dynmesh/topology.hpp>
#include <dynmesh/types.hpp>
#include <span>

#include "tracking/matches.hpp"

namespace dynmesh {

/// What the points and the edges tell of a surface X, which `matches` compared with its points
/// last. Hole and overlap are left at 0, and the quality is not judged.
Measure measured(const Matches& matches, const Agreement& agreement, double mean_edge,
                 const Cells& cells, std::span<const Vector3<double>> first_frame,
                 std::span<const Vector3<double>> x);

/// Without points, nothing speaks against a surface.
Quality judged(const Measure& measure);

}  // namespace dynmesh
