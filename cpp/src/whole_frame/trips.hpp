/// The trips of a completer to the ends of a window and back.
#pragma once

#include <cstddef>
#include <dynmesh/settings.hpp>
#include <dynmesh/types.hpp>
#include <functional>
#include <span>
#include <vector>

#include "whole_frame/constants.hpp"
#include "whole_frame/window.hpp"

namespace dynmesh {

/// What the last trip to one side found of each vertex of the base.
struct SideResult {
  std::vector<Vector3<double>> positions;
  std::vector<double> standard_error;  ///< infinity for disconnected vertices
  /// The number of frames to the nearest one on this side that knows the vertex, 0 if the base
  /// itself does, infinity if none does.
  std::vector<double> age;
};

/// The sides to which the trips go: in turn, beginning and ending with the frames before, or always
/// the same one if the window has no other.
template <class Real>
std::vector<Side> sides_of(const Window<Real>& window, const WholeFrameConstants& constants);

/// The number of frames that the trips complete.
template <class Real>
std::size_t steps_of(const Window<Real>& window, std::span<const Side> sides);

/// Makes the trips, one after another, each from the frame with which the last one came back; the
/// first starts from `start`. A trip is two sequences of a completer: one from the base to the end
/// of the window, and another one from there to the base. Returns the results of the last trip to
/// each side. Calls `step` before each frame.
template <class Real>
std::vector<SideResult> make_trips(Faces faces, const Settings& settings,
                                   const Window<Real>& window,
                                   std::span<const Vector3<double>> start,
                                   std::span<const Side> sides, const std::function<void()>& step);

}  // namespace dynmesh
