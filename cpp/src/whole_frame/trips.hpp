/// The trips of a completer to the ends of a window and back.
#pragma once

#include <cstddef>
#include <cstdint>
#include <dynmesh/settings.hpp>
#include <dynmesh/topology.hpp>
#include <dynmesh/types.hpp>
#include <functional>
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

/// What the last trip to one side found of each vertex of the base.
struct SideResult {
  std::vector<Vector3<double>> positions;
  std::vector<double> standard_error;  ///< infinity for disconnected vertices
  std::vector<std::uint8_t> seen;      ///< 1 if the base or a frame of this side knows it
};

/// The sides to which the trips from a frame go, which has so many other frames on each: in turn,
/// beginning and ending with those before, or always the same one if there is no other.
std::vector<Side> sides_of(std::size_t n_before, std::size_t n_after,
                           const WholeFrameConstants& constants);

/// Makes the trips, one after another, each from the frame with which the last one came back; the
/// first starts from `start`. A trip is two sequences of a completer: one from the base to the end
/// of the window, and another one from there to the base. Returns the results of the last trip to
/// each side. Calls `step` before each frame.
template <class Real>
std::vector<SideResult> make_trips(Faces faces, const Settings& settings,
                                   const Window<Real>& window,
                                   std::span<const Vector3<double>> start,
                                   std::span<const Side> sides, const std::function<void()>& step);

/// The weighted mean of the sides, y = sum of w_q y_q.
struct Combination {
  std::vector<Vector3<double>> positions;
  std::vector<double> disagreement;    ///< D: the mean of |y_q - y|^2 / 3
  std::vector<double> error_of_sides;  ///< S: the mean of s_q^2, infinity where all are
};

/// The weights w_q are proportional to s_q^(-3/2), where s_q is the standard error; a millionth of
/// that if the vertex was never seen on that side, and equal where no side is better. `results`
/// must not be empty.
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
