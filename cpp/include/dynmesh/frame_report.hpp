/// What a completer says of a frame.
#pragma once

#include <cstddef>

namespace dynmesh {

/// How an estimate was made; zeros where a method has no such stage.
struct StageReport {
  double blend = 0;             ///< b of method detail: the share of frame 0's shape
  double factor_seconds = 0;    ///< factoring the system of the unknown vertices
  double rotation_seconds = 0;  ///< fitting rotations
  double solve_seconds = 0;     ///< everything else
};

/// What happened to one frame; known + filled + unseen is the number of vertices.
struct FrameReport {
  std::size_t known = 0;       ///< anchors
  std::size_t filled = 0;      ///< satellites, estimated by the method
  std::size_t unseen = 0;      ///< not tied to an anchor: held, or moved rigidly
  std::size_t iterations = 0;  ///< of the method
  std::size_t rejected = 0;    ///< observed, but taken as unknown: outliers
  double seconds = 0;          ///< wall time of the call
  StageReport stages;          ///< where it went, and the blend that was found
};

}  // namespace dynmesh
