/// Tracks a template, on a coarse mesh first.
#pragma once

#include <cstddef>
#include <dynmesh/topology.hpp>
#include <dynmesh/types.hpp>
#include <memory>
#include <vector>

#include "base/training_frames.hpp"
#include "base/workers.hpp"
#include "shape/growth.hpp"
#include "shape/memory.hpp"
#include "surface_fit/coarse_surface.hpp"
#include "surface_fit/surface_errors.hpp"
#include "surface_fit/surface_level.hpp"

namespace dynmesh {

/// The iterations of a frame run on a coarse mesh of a large template, from which the template
/// follows. Some with all points then follow on the template itself, unless it is tracked live.
/// Holds nothing on which a later frame depends. Frames allocate memory.
class SurfaceFit {
 public:
  /// How a template is tracked.
  struct Options {
    std::size_t resolution = 0;  ///< the vertices of the coarse mesh, if live; 0: the best result
    bool uncertainty = false;
    double epsilon = 0;  ///< of the type in which positions are given
  };

  /// All references and `first_frame` must outlive this object. `training` is a training sequence,
  /// or empty.
  SurfaceFit(const std::vector<Triangle>& faces, const Topology& topology, Workers& workers,
             Field first_frame, const TrainingFrames& training, const Options& options);

  /// What is remembered of frame 0.
  void begin(Memory& memory) const;
  /// Finds the surface in a frame from what is remembered of the last one. `next` then holds the
  /// rotations of X, and what it says of modes.
  FittedSurface fit(const Memory& memory, const PointScan& scan, Memory& next,
                    int fewest_iterations = 1);
  /// Finds the standard errors of a frame, if they are wanted; see SurfaceErrors.
  void measure_errors(const FittedSurface& found, bool is_lost, const Memory& memory,
                      Memory& next) {
    errors_.measure(found, is_lost, memory, next);
  }
  /// Completes the next memory by the completed frame `next.last`. Velocities are 0 if nothing was
  /// found in it, and if the template was lost, it says nothing of what moves apart.
  void remember(const Memory& memory, const FittedSurface& found, bool moves, bool is_lost,
                Memory& next);

  [[nodiscard]] SurfaceLevel& whole() { return whole_; }
  [[nodiscard]] const SurfaceLevel& whole() const { return whole_; }

 private:
  struct Coarse {
    Coarse(DecimatedMesh mesh, SurfaceLevel& whole, const TrainingFrames& training, double epsilon,
           Workers& workers);

    CoarseSurface surface;
    SurfaceLevel level;
    Memory first;  // of frame 0
  };

  SurfaceLevel whole_;
  Growth growth_;
  SurfaceErrors errors_;
  std::unique_ptr<Coarse> coarse_;  // null if the template itself is small enough
  bool is_live_;
};

}  // namespace dynmesh
