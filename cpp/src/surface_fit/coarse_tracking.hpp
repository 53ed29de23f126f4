/// Tracks a coarse mesh of a template, and restores the template.
#pragma once

#include <dynmesh/topology.hpp>
#include <dynmesh/types.hpp>
#include <span>
#include <vector>

#include "base/training_frames.hpp"
#include "base/workers.hpp"
#include "mesh/decimation.hpp"
#include "shape/memory.hpp"
#include "shape/model.hpp"
#include "shape/rotations.hpp"
#include "shape/shape_system.hpp"
#include "surface_fit/cloth.hpp"
#include "surface_fit/surface_tracking.hpp"

namespace dynmesh {

/// Finds some of the vertices of a surface, and then all others as a completion does from these as
/// anchors: with the shape of the last frame, turned as the surface around them. What it remembers
/// is that of the whole mesh, beside the fit of its modes.
class CoarseTracking {
 public:
  /// `whole`, `materials` and `workers` must outlive this object.
  CoarseTracking(DecimatedMesh mesh, const ShapeModel& whole, std::span<const Material> materials,
                 Workers& workers, const TrackingConstants& constants,
                 const TrainingFrames& training, double epsilon);

  /// Lets the coarse mesh follow points as the whole mesh, with these matches, lies around it.
  void measure_heights(Matches& whole) {
    tracking_.matches_.measure_heights(first_frame_, whole, whole_.first_frame);
  }

  /// What is remembered of frame 0.
  void begin(Memory& memory) const;

  /// Finds X, (k,), and its rotations. `rest` is the rest shape of the whole mesh. Returns how
  /// often points were matched.
  int fit(const Memory& memory, const PointScan& measurement, Field rest, Memory& next,
          std::span<Vector3> x);

 private:
  void gather(const Memory& memory);
  void restore(const Memory& memory, Field rest, Memory& next, std::span<Vector3> x);

  const ShapeModel& whole_;
  std::span<const Material> materials_;
  Workers& workers_;
  DecimatedMesh mesh_;
  Topology topology_;
  std::vector<Vector3> first_frame_;
  SurfaceTracking tracking_;
  Memory memory_, next_;
  std::vector<Index> nearest_;  // (clusters,) the coarse vertex that is nearest to each
  Anchors anchors_;             // always the same, so that the whole system is factored once
  ShapeSystem system_;
  Rotations rotations_;

  // Of the current frame:
  std::vector<Quaternion> turns_;  // (clusters,)
  std::vector<Vector3> shape_, kx_;
};

}  // namespace dynmesh
