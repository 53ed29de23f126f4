/// What a training sequence says about a subject, for those who choose one.
#pragma once

#include <cstddef>
#include <dynmesh/topology.hpp>
#include <dynmesh/training.hpp>
#include <dynmesh/types.hpp>

namespace dynmesh {

/// Lengths are in the unit of the positions. The distance of a frame is the root mean square
/// distance of its vertices from those of frame 0, after the rigid motion that fits it best.
struct TrainingSummary {
  std::size_t frames = 0;       ///< that were added
  double variance_held = 0;     ///< the share of the variance of shape that the global modes hold
  double rms_distance = 0;      ///< the root mean square of the distances of the frames
  double largest_distance = 0;  ///< the distance of the farthest frame
};

/// Learns from a training sequence as a completer with this frame 0 does, and describes the result.
/// Throws what the constructor of Completer throws.
template <class Real>
TrainingSummary summarise(Faces faces, Points<const Real> first_frame,
                          const Training<Real>& training);

}  // namespace dynmesh
