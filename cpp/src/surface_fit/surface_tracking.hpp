/// Finds a template again in what sensors measured, frame by frame; docs/reference/tracking.md has
/// the method.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <dynmesh/topology.hpp>
#include <dynmesh/types.hpp>
#include <limits>
#include <span>
#include <vector>

#include "base/training_frames.hpp"
#include "base/workers.hpp"
#include "shape/memory.hpp"
#include "shape/model.hpp"
#include "surface_fit/constants.hpp"
#include "surface_fit/matches.hpp"
#include "surface_fit/nonrigid_step.hpp"
#include "surface_fit/point_scan.hpp"

namespace dynmesh {

/// What a frame is found by, beside its points.
struct Guides {
  std::span<const Landmark> landmarks = {};
  /// Points are matched so often at least, and more often where they are far; of more iterations,
  /// the first are stiffer. In the last one, a point weighs so many times its usual weight.
  int fewest_iterations = 1;
  double times_weight = 1;
  double yields_beyond = std::numeric_limits<double>::infinity();  ///< as NonrigidStep::Draw
};

/// The places of the points on the surface and the rotations of its shape depend on the positions X
/// of a frame, so they and X are found in turn. Holds nothing on which a later frame depends.
/// Frames allocate memory.
class SurfaceTracking {
 public:
  /// `topology`, `workers` and `first_frame` must outlive this object. `training` is a training
  /// sequence, or empty. `epsilon` is that of the type in which positions are given.
  SurfaceTracking(std::vector<Triangle> faces, const Topology& topology, Workers& workers,
                  Field first_frame, const TrackingConstants& constants = {},
                  const TrainingFrames& training = {}, bool has_uncertainty = false,
                  double epsilon = std::numeric_limits<double>::epsilon(),
                  std::vector<Material> materials = {});

  /// Lets the points be matched as with the whole of which this is a coarse mesh, in frame 0 of
  /// both.
  void measure_heights(SurfaceTracking& whole) {
    matches_.measure_heights(model_.first_frame, whole.matches_, whole.model_.first_frame);
  }

  /// What is remembered of frame 0.
  void begin(Memory& memory) const;

  /// What was found in a frame, valid until the next call.
  struct Found {
    Field x;                                 ///< (k,) the positions
    std::span<const std::uint8_t> observed;  ///< (k,) 1 for vertices that have a measured point
    int iterations = 0;
    Agreements agreements = {};  ///< how well the positions explain the points
    /// The vertices of the largest component that is lost; none if none is.
    std::vector<std::size_t> lost = {};
  };

  /// Finds the surface in a frame from what is remembered of the last one. `next` then holds the
  /// rotations of X, and what it says of modes.
  Found fit(const Memory& memory, const PointScan& measurement, const Guides& guides, Memory& next);
  /// The same without what is observed. Returns how often points were matched.
  int find(const Memory& memory, const PointScan& measurement, const Guides& guides, Memory& next);

  /// Starts a frame that is found otherwise than by `find`. Returns X, (k,), to be set like the
  /// rotations in `next`.
  std::span<Vector3> start(const Memory& memory, const PointScan& measurement, Memory& next);
  /// Ends such a frame: iterates from X with the last weights until it lies still, so often at
  /// most. `iterations` preceded elsewhere.
  Found settle(const Memory& memory, int most_iterations, int iterations, Memory& next);

  /// Compares a frame with what was measured.
  Found compare(Field frame, const PointScan& measurement);

  /// Completes the next memory by the completed frame `next.last` of what `fit` has just found, and
  /// does not throw. Velocities are 0 if nothing was found in it.
  void remember(const Memory& memory, bool moves, Memory& next);
  /// (pairs,) by how much components have moved apart in a frame, after frames that left
  /// `departures`.
  [[nodiscard]] std::vector<double> departures(const Memory& frame,
                                               std::span<const double> departures) {
    return shape_.ties().departed(frame.last, frame.q, departures);
  }
  /// Finds the standard errors of the frame that `fit` has just found, and does not throw. Where
  /// the surface was lost, the far points tell how far from it unseen vertices may be.
  void measure_errors(const Memory& memory, bool is_lost, Memory& next) {
    shape_.measure_errors(memory, x_, is_lost ? matches_.distance_of_far() : 0, next);
  }

  /// Sets the rotations in a memory to those of the positions that were found last.
  void fit_rotations(Memory& memory) { shape_.fit_rotations(x_, memory.q); }
  /// Sets the rotations and the shape in a memory to those of its last frame.
  void find_shape(Memory& memory) { shape_.remember(memory.last, memory); }

  /// Lets a memory be of this frame, at rest and in any pose.
  void place(Field frame, Memory& memory);
  /// Lets the last frame have the rest shape, where its own is not trusted.
  void forget_shape(Memory& memory) {
    shape_.find_rest_shape(memory.fit);
    std::ranges::copy(shape_.rest_shape(), memory.m.begin());
  }
  /// Bends the last frame, without points, while its landmarks move to their targets.
  void bend(const Guides& guides, int steps, Memory& memory);

  /// (k,) of the frame that was found last.
  [[nodiscard]] Field x() const { return x_; }
  /// (k,) the rest shape in the frame that has been started.
  [[nodiscard]] Field rest_shape() const { return shape_.rest_shape(); }
  [[nodiscard]] const ShapeModel& model() const { return model_; }
  [[nodiscard]] std::span<const Material> materials() const { return materials_; }
  [[nodiscard]] bool any_slides() const { return any_slides_; }
  [[nodiscard]] const Matches& matches() const { return matches_; }
  [[nodiscard]] double mean_edge() const { return model_.mean_edge; }
  [[nodiscard]] const TrackingConstants& constants() const { return constants_; }

 private:
  void predict(const Memory& memory, const PointScan& measurement);
  [[nodiscard]] std::vector<std::size_t> find_groups(const Memory& memory);
  void predict_components(const Memory& memory, Field led_to, const PointScan& measurement);
  [[nodiscard]] std::vector<Vector3> wanted_differences(const Memory& memory);
  int approach(const Memory& memory, int fewest_iterations);
  bool find_lost();
  [[nodiscard]] std::vector<std::uint8_t> find_placed() const;
  bool iterate(int left, bool fits_modes, double settled, const Guides& guides,
               const Memory& memory, Memory& next);
  Found observe(int iterations);
  Found compared(int iterations);
  /// Whether no vertex moved farther than the root of this.
  [[nodiscard]] bool lies_still(double squared) const {
    return squared < std::pow(constants_.resolution * model_.mean_edge, 2);
  }

  TrackingConstants constants_;
  std::vector<Triangle> faces_;
  ShapeModel model_;
  std::vector<Material> materials_;
  NonrigidStep shape_;
  Matches matches_;
  bool all_slide_, any_slides_;
  std::size_t points_at_first_, rigid_points_;  // of which a part suffices

  // Of the current frame:
  double factored_weight_ = 0;  // of the iteration for which the preconditioner was factored
  std::vector<Vector3> x_;
  std::vector<std::uint8_t> observed_;
};

}  // namespace dynmesh
