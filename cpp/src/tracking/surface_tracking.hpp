/// Finds a template again in what sensors measured, frame by frame; docs/reference/tracking.md has
/// the method.
#pragma once

#include <cstdint>
#include <dynmesh/topology.hpp>
#include <dynmesh/types.hpp>
#include <limits>
#include <span>
#include <vector>

#include "support/workers.hpp"
#include "tracking/agreement.hpp"
#include "tracking/constants.hpp"
#include "tracking/matches.hpp"
#include "tracking/nonrigid_step.hpp"
#include "tracking/point_scan.hpp"

namespace dynmesh {

/// Correspondences and the rotations of the shape depend on the positions X of a frame, so they and
/// X are found in turn.
///
/// Allocates memory in `reset`, and in `track` if the factor or the measurement is larger than all
/// earlier ones.
class SurfaceTracking {
 public:
  using Field = std::span<const Vector3<double>>;

  /// `topology` and `workers` must outlive this object. `training` is a training sequence, or
  /// empty. `epsilon` is that of the type in which positions are given.
  SurfaceTracking(std::vector<Triangle> faces, const Topology& topology, Workers& workers,
                  const TrackingConstants& constants = {}, TrainingFrames training = {},
                  bool has_uncertainty = false,
                  double epsilon = std::numeric_limits<double>::epsilon());

  /// Begins a sequence. If it throws, nothing has changed.
  void reset(Field first_frame);

  /// What was found in a frame, valid until the next call.
  struct Found {
    Field x;                                 ///< (k,) the positions
    std::span<const std::uint8_t> observed;  ///< (k,) 1 for vertices that have a measured point
    int iterations = 0;
    Agreements agreements = {};  ///< how well the positions explain the points
  };

  /// Finds the surface in a frame, from the last frames, and does not remember it. If it throws,
  /// nothing has changed.
  Found track(const PointScan& measurement);

  /// Forgets the frame that `track` has just found.
  void undo() { shape_.undo_frame(); }

  /// Makes this the last frame, at rest and in any pose, whatever was before.
  void place(Field frame);

  /// Finds the standard errors of the frame that `track` has just found. `generations` are those of
  /// its vertices.
  void measure_errors(const Generations& generations) { shape_.measure_errors(generations, x_); }

  /// Makes this the last frame. Velocities are 0 if nothing was found in it.
  void remember(Field completed, bool moves);

  [[nodiscard]] const NonrigidStep& shape() const { return shape_; }
  [[nodiscard]] std::span<const Triangle> faces() const { return faces_; }
  /// (k,) the last frame.
  [[nodiscard]] Field last() const { return last_; }

  /// What later frames depend on, beside frame 0 and the last frame.
  struct Memory {
    std::vector<Vector3<double>> before;
    NonrigidStep::Memory shape;
  };
  [[nodiscard]] std::size_t memory_size() const;
  void write_memory(Writer& writer) const;
  /// Refuses a memory that `write_memory` cannot have written.
  [[nodiscard]] Memory read_memory(Reader& reader) const;
  void recall(const Memory& memory, Field last);

  [[nodiscard]] double mean_edge() const { return mean_edge_; }
  [[nodiscard]] const TrackingConstants& constants() const { return constants_; }

 private:
  void predict();
  int approach();
  void iterate(int left, int fits);
  Found observe(const PointScan& measurement);

  TrackingConstants constants_;
  std::vector<Triangle> faces_;
  const Topology& topology_;
  Matches matches_;
  NonrigidStep shape_;
  double mean_edge_ = 1;
  bool is_all_cloth_ = false;
  bool any_cloth_ = false;
  std::vector<Vector3<double>> last_;
  std::vector<Vector3<double>> before_;  // the frame before the last
  std::vector<Vector3<double>> x_;       // the current frame
  std::vector<std::uint8_t> observed_;
};

}  // namespace dynmesh
