/// Finds a template again in what sensors measured, frame by frame; docs/reference/tracking.md has
/// the method.
#pragma once

#include <cstdint>
#include <dynmesh/topology.hpp>
#include <dynmesh/types.hpp>
#include <limits>
#include <span>
#include <vector>

#include "detail/anchors.hpp"
#include "detail/constants.hpp"
#include "detail/error_bars.hpp"
#include "detail/rotations.hpp"
#include "detail/rounding.hpp"
#include "detail/shape_system.hpp"
#include "support/workers.hpp"
#include "tracking/constants.hpp"
#include "tracking/measurement.hpp"
#include "tracking/point_scan.hpp"
#include "tracking/rest_shape.hpp"
#include "tracking/surface_fit.hpp"
#include "tracking/visibility.hpp"

namespace dynmesh {

/// The positions X of a frame minimise |K X - Q m|^2 + sum_i w_i (n_i . (q_i - X_i))^2. K and Q are
/// those of method detail, m is between the shapes of the last frame and of frame 0, and q_i,
/// n_i is the measured point, with its normal, that is nearest to vertex i. Both Q and the
/// correspondences depend on X, so they and X are found in turn.
///
/// Allocates memory in `reset`, and in `find` if the factor is larger than all earlier ones.
class SurfaceTracking {
 public:
  using Field = std::span<const Vector3<double>>;

  /// `topology` and `workers` must outlive this object. `training` is a training sequence, or
  /// empty. `epsilon` is that of the type in which positions are given.
  SurfaceTracking(std::vector<Triangle> faces, const Topology& topology, Workers& workers,
                  const TrackingConstants& constants = {}, TrainingFrames<double> training = {},
                  bool has_uncertainty = false,
                  double epsilon = std::numeric_limits<double>::epsilon());

  /// Begins a sequence. If it throws, nothing has changed.
  void reset(Field first_frame);

  /// What was found in a frame, valid until the next call.
  struct Found {
    Field x;                                 ///< (k,) the positions
    std::span<const std::uint8_t> observed;  ///< (k,) 1 for vertices that have a measured point
    int iterations = 0;
    double distance = 0;   ///< root mean square of the observed vertices from their planes
    bool aligned = false;  ///< whether a rigid alignment of the whole template was needed
  };

  /// Finds the surface in a frame, from the last frames, and does not remember it. If it throws,
  /// nothing has changed. It throws std::invalid_argument only in the first frame, if the template
  /// is far from the measurement even after an alignment.
  Found find(const Measurement& measurement);

  /// Finds the standard errors of the frame that `find` has just found. `generations` are those of
  /// its vertices.
  void measure_errors(const Generations& generations);
  [[nodiscard]] const ErrorBars& error_bars() const { return error_bars_; }
  [[nodiscard]] const RestShape& rest() const { return rest_; }

  /// Makes this the last frame. Velocities are 0 if nothing was found in it.
  void remember(Field completed, bool moves);

  /// What later frames depend on, beside frame 0: the last two frames, the rotations, the pose and
  /// the errors.
  [[nodiscard]] Field last() const { return last_; }
  [[nodiscard]] Field before() const { return before_; }
  [[nodiscard]] std::span<const Quaternion> rotations() const { return rotations_.quaternions(); }
  [[nodiscard]] bool is_first() const { return is_first_; }
  void recall(Field last, Field before, std::span<const Quaternion> rotations, bool is_first);
  void recall_pose(const RestShape::Memory& memory) { rest_.recall(memory); }
  void recall_errors(const ErrorBars::Memory& memory) { error_bars_.recall(memory); }

  [[nodiscard]] double mean_edge() const { return mean_edge_; }
  [[nodiscard]] const TrackingConstants& constants() const { return constants_; }

 private:
  /// How correspondences are found and weighed.
  struct Search {
    double radius = 0;
    double scale = 0;
    double side = 0;
    double weight = 0;
    std::size_t stride = 1;
    bool takes_any = false;  ///< a point within the radius is enough, though not the nearest
  };
  struct Tally {
    std::size_t seen = 0;
    std::size_t found = 0;
  };

  void predict();
  void find_seen_normals();
  void find_visible(const Measurement& measurement);
  Tally correspond(const Measurement& measurement, const Search& search);
  void weigh_shared_points(std::size_t n_points);
  [[nodiscard]] bool is_near(const Measurement& measurement, std::uint32_t point, std::size_t v,
                             double radius) const;
  [[nodiscard]] std::size_t rigid_stride() const;
  void move_as_a_whole(const Measurement& measurement, const Search& search);
  bool lies_in(const Measurement& measurement, double share);
  bool align(const Measurement& measurement);
  [[nodiscard]] double share_without_point(double distance) const;
  double draw_towards_unexplained(const Measurement& measurement, double weight);
  bool choose_components(double weight);
  [[nodiscard]] double weight_at(double progress) const;
  int search(const Measurement& measurement);
  double nonrigid_step(const Measurement& measurement, double weight, bool is_early,
                       bool poses = false);
  void pose();
  void observe_planes();
  Found observe(const Measurement& measurement);

  TrackingConstants constants_;
  DetailConstants detail_constants_;
  std::vector<Triangle> faces_;
  const Topology& topology_;
  Workers& workers_;
  ShapeSystem system_;
  Rotations rotations_;
  SurfaceFit fit_;
  Visibility visibility_;
  std::vector<std::uint8_t> is_sheet_;  // whether the back of a vertex can be seen
  double mean_edge_ = 1;
  double epsilon_;
  Rounding rounding_;
  bool is_first_ = true;
  RestShape rest_;
  ErrorBars error_bars_;
  std::vector<Vector3<double>> shape_;  // Q^T K X of the last frame
  std::vector<Vector3<double>> last_;
  std::vector<Vector3<double>> before_;  // the frame before the last

  // Of the current frame:
  Anchors anchors_;
  std::vector<Vector3<double>> x_, normals_, wanted_, turned_;
  std::vector<Correspondence> found_;
  std::vector<Sight> seen_;
  std::vector<std::uint8_t> observed_;
  std::vector<double> found_in_;  // the correspondences of each component, weighed
  std::vector<Quaternion> old_rotations_;
  bool is_factored_ = false;
  std::vector<std::uint32_t> vertices_near_;  // a vertex near each measured point, if any is known
  std::vector<std::uint32_t> vertices_per_point_;  // how many vertices take each measured point
  std::vector<std::uint32_t> guesses_;             // the last measured point of each vertex
  PointScan vertices_;                             // the surface itself
  std::vector<Correspondence> drawn_;
  std::vector<double> factored_weights_;  // those of the preconditioner, while the pose is found
  // With standard errors:
  std::vector<Vector3<double>> kx_;      // K X
  std::vector<Vector3<double>> planes_;  // the normals of the correspondences
};

}  // namespace dynmesh
