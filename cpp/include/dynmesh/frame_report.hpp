/// The statistics of a completed frame.
#pragma once

#include <array>
#include <cstddef>
#include <dynmesh/quality.hpp>

namespace dynmesh {

/// Details of how an estimate was computed. All are 0 for a method that has no such stage.
struct StageReport {
  double blend = 0;              ///< b of method detail, the weight of the shape of frame 0
  double prior_weight = 0;       ///< 0 to 1, how much the training frames are used; 1 with `learn`
  double prior_share = 0;        ///< the share of the residual that they explain
  double first_order_share = 0;  ///< how far estimated vertices keep their edges, 0 to 1; the mean
  double factor_seconds = 0;     ///< factorisation of the system of the unknown vertices
  double rotation_seconds = 0;   ///< fitting of rotations
  double solve_seconds = 0;      ///< everything else

  bool operator==(const StageReport&) const = default;
};

/// Statistics of one frame. known + filled + disconnected is the number of vertices.
struct FrameReport {
  std::size_t known = 0;         ///< anchors
  std::size_t filled = 0;        ///< satellites, estimated by the method
  std::size_t disconnected = 0;  ///< not connected to an anchor: held, or moved rigidly
  std::size_t iterations = 0;    ///< iterations of the method
  std::size_t rejected = 0;      ///< observed, but treated as unknown: outliers
  /// With `uncertainty`, the root mean square of the standard errors of the satellites, in the unit
  /// of the positions; else, and without satellites, 0.
  double standard_error = 0;
  double seconds = 0;  ///< wall time of the call
  StageReport stages;  ///< the parts of that time, and the blend
  /// Of a tracked frame, that of its measure. Of a completed one, `ruined` if many edges are far
  /// longer or shorter than in frame 0, as of points that belong to other vertices, or if it is a
  /// mirror image of the frame before or of another subject, once a few frames have shown what is
  /// usual; no later frame follows from a ruined one, unless three that agree follow each other.
  /// `doubtful` if frame 0 seems to be in another unit of length, a mirror image, of another
  /// subject or in another order of vertices, which the first frames show, or if nothing is known.
  /// A part that is estimated wrongly with edges of the right lengths is not noticed.
  Quality quality = Quality::good;
  std::array<char, 512> reason{};  ///< why it is not good, ending with 0; empty if it is

  bool operator==(const FrameReport&) const = default;
};

}  // namespace dynmesh
