/// The shapes of a training sequence, in the axes of frame 0.
#pragma once

#include <algorithm>
#include <dynmesh/topology.hpp>
#include <dynmesh/types.hpp>
#include <span>
#include <vector>

#include "detail/detail_operator.hpp"
#include "detail/modes.hpp"
#include "detail/rounding.hpp"
#include "support/workers.hpp"

namespace dynmesh {

/// Frames of the same mesh, each (k,).
using TrainingFrames = std::vector<std::vector<Vector3<double>>>;

/// Returns z = Q^T K V - m_0 of each frame V of the training frames: for each vertex, the
/// deviations in all frames, (k, n_frames). Q is fitted to the frame until it no longer changes,
/// from the rotation that fits the whole frame best, since its pose may be far from `first`. A
/// sequence that was moved and turned as a whole has the same shapes. The rotations of all frames
/// are averaged widely, unless neighbouring clusters are turned against each other by more than
/// `largest_stiff_angle` degrees, on average over the training frames.
std::vector<Vector3<double>> training_shapes(const TrainingFrames& training,
                                             const DetailOperator& k, const Cells& cells,
                                             std::span<const Vector3<double>> first,
                                             double mean_edge, double largest_stiff_angle,
                                             Workers& workers);

/// What their modes are measured by.
inline ModeScale scale_of(const TrainingFrames& training, const Rounding& rounding,
                          double mean_edge) {
  ModeScale scale = {mean_edge, 0};
  for (const auto& frame : training) {
    scale.rounding = std::max(scale.rounding, rounding.mean_square(frame));
  }
  return scale;
}

}  // namespace dynmesh
