/// Finds a template again in what sensors measured, frame by frame; docs/reference/tracking.md has
/// the method.
#pragma once

#include <cstdint>
#include <dynmesh/topology.hpp>
#include <dynmesh/types.hpp>
#include <limits>
#include <span>
#include <vector>

#include "base/training_frames.hpp"
#include "base/workers.hpp"
#include "surface_fit/constants.hpp"
#include "surface_fit/matches.hpp"
#include "surface_fit/nonrigid_step.hpp"
#include "surface_fit/point_scan.hpp"

namespace dynmesh {

/// The places of the points on the surface and the rotations of its shape depend on the positions X
/// of a frame, so they and X are found in turn. Frames allocate memory.
class SurfaceTracking {
 public:
  using Field = std::span<const Vector3<double>>;

  /// Begins a sequence. `topology` and `workers` must outlive this object. `training` is a training
  /// sequence, or empty. `epsilon` is that of the type in which positions are given.
  SurfaceTracking(std::vector<Triangle> faces, const Topology& topology, Workers& workers,
                  Field first_frame, const TrackingConstants& constants = {},
                  const TrainingFrames& training = {}, bool has_uncertainty = false,
                  double epsilon = std::numeric_limits<double>::epsilon());

  /// What was found in a frame, valid until the next call.
  struct Found {
    Field x;                                 ///< (k,) the positions
    std::span<const std::uint8_t> observed;  ///< (k,) 1 for vertices that have a measured point
    int iterations = 0;
    Agreements agreements = {};  ///< how well the positions explain the points
  };

  /// Finds the surface in a frame, from what is remembered of the last ones, and does not remember
  /// it: frames may be found again, and nothing is lost if this throws. Points are matched so often
  /// at least, and more often where they are far; of more iterations, the first are stiffer. In the
  /// last one, a point weighs so many times its usual weight.
  Found track(const PointScan& measurement, std::span<const Landmark> landmarks = {},
              int fewest_iterations = 1, double times_weight = 1);
  /// Compares the last frame with what was measured.
  Found compare_last(const PointScan& measurement);

  /// Finds the standard errors of the frame that `track` has just found, and does not throw.
  /// `generations` are those of its vertices. Where the surface was lost, the far points tell how
  /// far from it unseen vertices may be.
  void measure_errors(const Generations& generations, bool is_lost) {
    shape_.measure_errors(generations, x_, is_lost ? matches_.distance_of_far() : 0);
  }

  /// Makes this the last frame. Velocities are 0 if nothing was found in it.
  void remember(Field completed, bool moves);

  /// Makes this the last frame, at rest and in any pose, whatever was before.
  void place(Field frame);
  /// Lets the last frame have the shape of frame 0, where its own is not trusted.
  void forget_shape() { shape_.forget_shape(); }
  /// Bends the last frame, without points, while its landmarks move to their targets.
  void bend(std::span<const Landmark> landmarks, int steps);

  /// As NonrigidStep::yield_beyond; at first, the shape yields nowhere.
  void yield_beyond(double medians) { shape_.yield_beyond(medians); }

  [[nodiscard]] const NonrigidStep& shape() const { return shape_; }
  [[nodiscard]] const Matches& matches() const { return matches_; }
  /// (k,) the last frame.
  [[nodiscard]] Field last() const { return last_; }
  [[nodiscard]] double mean_edge() const { return mean_edge_; }
  [[nodiscard]] const TrackingConstants& constants() const { return constants_; }

  /// What later frames depend on, beside frame 0 and the last frame.
  void write_memory(Writer& writer) const;
  /// Reads what `write_memory` wrote, with the last frame. Refuses other numbers, and is of no use
  /// then.
  void read_memory(Reader& reader, Field last);

 private:
  void begin_where_points_are();
  int approach(int fewest_iterations);
  bool iterate(int left, double last_weight, std::span<const Landmark> landmarks);
  Found observe();

  TrackingConstants constants_;
  std::vector<Triangle> faces_;
  double mean_edge_;
  std::vector<Material> materials_;
  NonrigidStep shape_;
  Matches matches_;
  bool all_slide_, any_slides_;
  double factored_weight_ = 0;  // of the iteration for which the preconditioner was factored
  std::vector<Vector3<double>> last_, before_;  // the last frame, and the one before it
  std::vector<Vector3<double>> x_;              // the current frame
  std::vector<std::uint8_t> observed_;
};

}  // namespace dynmesh
