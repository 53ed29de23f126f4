/// The frame from which the first trip of whole_frame starts.
#pragma once

#include <cstdint>
#include <dynmesh/topology.hpp>
#include <dynmesh/types.hpp>
#include <span>
#include <vector>

#include "support/workers.hpp"
#include "whole_frame/constants.hpp"
#include "whole_frame/window.hpp"

namespace dynmesh {

/// A frame, and which of its vertices were observed, in it or in another frame.
struct PartialFrame {
  std::vector<Vector3<double>> positions;
  std::vector<std::uint8_t> fixed;
};

/// The known vertices of the base. A component of which it knows fewer than four vertices comes
/// from the frame that knows most of them, moved rigidly to the vertices that both frames know.
template <class Real>
PartialFrame known_parts(const Topology& topology, const Window<Real>& window,
                         const WholeFrameConstants& constants);

/// Solves L^2 x = 0 for the vertices that are not fixed, where L is the uniform Laplacian: the
/// smoothest surface through the others. Components without any fixed vertex shrink to the mean of
/// the fixed vertices, as nothing is known of them.
std::vector<Vector3<double>> smooth_fill(const Topology& topology, PartialFrame frame,
                                         Workers& workers);

}  // namespace dynmesh
