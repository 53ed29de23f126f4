/// Finds a surface again in what sensors measured, frame by frame; docs/reference/tracking.md has
/// the method.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <dynmesh/topology.hpp>
#include <dynmesh/types.hpp>
#include <limits>
#include <optional>
#include <span>
#include <vector>

#include "base/training_frames.hpp"
#include "base/workers.hpp"
#include "shape/memory.hpp"
#include "shape/model.hpp"
#include "surface_fit/constants.hpp"
#include "surface_fit/nonrigid_step.hpp"
#include "surface_fit/point_scan.hpp"
#include "surface_fit/surface_matcher.hpp"

namespace dynmesh {

/// What a frame is found by, beside its points.
struct FitOptions {
  std::span<const Landmark> landmarks = {};
  /// Points are matched so often at least, and more often where they are far; of more iterations,
  /// the first are stiffer. In the last one, a point weighs so many times its usual weight.
  int fewest_iterations = 1;
  double times_weight = 1;
  /// How many times more points weigh for their noise. Larger weights begin where the surface has
  /// arrived, since before that the distance of a point is not noise, and take more iterations.
  double precision = 1;
  Field whole = {};  ///< the last frame of the whole of which this is a coarse mesh, or empty
  bool matches_colours = true;                                     ///< of points that have them
  double yields_beyond = std::numeric_limits<double>::infinity();  ///< as StepInput
};

/// A frame while it is found.
struct SurfaceFrame {
  std::vector<Vector3> x;  ///< (k,) the positions
  MatchedPoints points;
  Visibility visibility;
  WeightedTies ties;                  ///< that held x last
  std::vector<SurfaceRow> rows = {};  ///< to which the last step drew x
  int iterations = 0;
};

/// A frame that was found.
struct FittedSurface : SurfaceFrame {
  std::vector<Vector3> normals;        ///< (k,) as normals_of
  std::vector<std::uint8_t> observed;  ///< (k,) 1 for vertices that have a measured point
  Agreements agreements;               ///< how well the positions explain the points
  /// The vertices of the largest component that is lost; none if none is.
  std::vector<std::size_t> lost;
  std::vector<Vector3> shape;  ///< (k,) that K X was to have, if standard errors are wanted
};

/// One level of detail of a surface: all of its vertices, or a coarse mesh. The places of the
/// points on the surface and the rotations of its shape depend on the positions X of a frame, so
/// they and X are found in turn. Holds nothing on which a later frame depends. Frames allocate
/// memory.
class SurfaceLevel {
 public:
  /// `topology`, `workers` and `first_frame` must outlive this object. `training` is a training
  /// sequence, or empty. `epsilon` is that of the type in which positions are given.
  SurfaceLevel(std::vector<Triangle> faces, const Topology& topology, Workers& workers,
               Field first_frame, const TrackingConstants& constants = {},
               const TrainingFrames& training = {}, bool has_uncertainty = false,
               double epsilon = std::numeric_limits<double>::epsilon(),
               std::vector<Material> materials = {});

  /// Lets the points be matched as with the whole of which this is a coarse mesh, in frame 0 of
  /// both. It must outlive this object.
  void measure_heights(SurfaceLevel& whole) {
    matcher_.measure_heights(model_.first_frame, whole.matcher_, whole.model_.first_frame);
    finer_ = &whole.matcher_;
  }

  /// What is remembered of frame 0.
  void begin(Memory& memory) const;

  /// Finds the surface in a frame from what is remembered of the last one. `next` then holds the
  /// rotations of X, and what it says of modes.
  FittedSurface fit(const Memory& memory, const PointScan& scan, const FitOptions& options,
                    Memory& next) {
    return compared(find(memory, scan, options, next), memory, next);
  }
  /// The frame that `fit` finds, not yet compared with the points.
  SurfaceFrame find(const Memory& memory, const PointScan& scan, const FitOptions& options,
                    Memory& next);
  /// Iterates from X (k,), of which `next` holds the rotations, with the last weights until it lies
  /// still, so often at most. `iterations` preceded elsewhere. `next` then holds how far they led.
  FittedSurface refine(std::vector<Vector3> x, const Memory& memory, const PointScan& scan,
                       const FitOptions& options, int most_iterations, int iterations,
                       Memory& next);

  /// Compares a frame with what was measured.
  FittedSurface agreement_with(const PointScan& scan, std::vector<Vector3> frame);

  /// Completes the next memory by the completed frame `next.last`. Velocities are 0 if nothing was
  /// found in it.
  void remember(const Memory& memory, bool moves, Memory& next);
  /// (pairs,) by how much components have moved apart in a frame, after frames that left
  /// `departures`.
  [[nodiscard]] std::vector<double> departures(const Memory& frame,
                                               std::span<const double> departures) const {
    return step_.ties().departed(frame.last, frame.q, departures);
  }

  /// The ties between components.
  [[nodiscard]] std::span<const Tie> ties() const { return step_.ties().between(); }

  /// Sets the rotations in a memory to those of its last frame.
  void fit_rotations(Memory& memory) { step_.fit_rotations(memory.last, memory.q); }
  /// Sets the rotations and the shape in a memory to those of its last frame.
  void find_shape(Memory& memory) { step_.remember(memory.last, memory); }
  /// Lets a memory be of this frame, at rest and in any pose.
  void place(Field frame, Memory& memory);
  /// Lets the last frame have the rest shape, where its own is not trusted.
  void forget_shape(Memory& memory) { memory.m = rest_shape(memory); }
  /// Bends the last frame, without points, while its landmarks move to their targets.
  void bend(const FitOptions& options, int steps, Memory& memory);

  [[nodiscard]] std::vector<Vector3> rest_shape(const Memory& memory) {
    return step_.rest_shape(memory);
  }
  [[nodiscard]] std::vector<Vector3> normals_of(Field x) const { return matcher_.normals_of(x); }
  [[nodiscard]] const ShapeModel& model() const { return model_; }
  /// The memory of a factor of N with the membrane, which nothing has between frames.
  [[nodiscard]] Lender<MaskedFactor>& factors() { return step_.factors(); }
  [[nodiscard]] std::span<const Material> materials() const { return materials_; }
  [[nodiscard]] double mean_edge() const { return model_.mean_edge; }
  [[nodiscard]] const TrackingConstants& constants() const { return constants_; }

 private:
  /// The preconditioner of the iterations from one with this weight of the points on.
  struct Preconditioner {
    Lent<MaskedFactor> factor;
    double weight = 0;
  };

  [[nodiscard]] std::vector<Vector3> wanted_differences(const Memory& memory) const;
  void align_rigidly(const Memory& memory, const FitOptions& options, SurfaceFrame& frame);
  [[nodiscard]] std::vector<std::uint8_t> find_placed(const SurfaceFrame& frame) const;
  bool seek_lost(SurfaceFrame& frame);
  bool iterate(int left, bool fits_modes, const SolverLimits& limits, const FitOptions& options,
               const Memory& memory, std::optional<Preconditioner>& preconditioner,
               SurfaceFrame& frame, Memory& next);
  FittedSurface compared(SurfaceFrame frame, const Memory& memory, const Memory& next);
  [[nodiscard]] FittedSurface agreement_of(SurfaceFrame frame) const;
  /// Whether no vertex moved farther than the root of this.
  [[nodiscard]] bool lies_still(double squared) const {
    return squared < std::pow(constants_.resolution * model_.mean_edge, 2);
  }

  Workers& workers_;
  TrackingConstants constants_;
  std::vector<Triangle> faces_;
  ShapeModel model_;
  std::vector<Material> materials_;
  NonrigidStep step_;
  SurfaceMatcher matcher_;
  const SurfaceMatcher* finer_ = nullptr;
  bool all_slide_, any_slides_, has_uncertainty_;
  std::size_t points_at_first_, rigid_points_;  // of which a part suffices
};

}  // namespace dynmesh
