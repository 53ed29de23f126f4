/// The shape of a tracked surface, and the step that brings the surface to measured points while
/// this shape resists.
#pragma once

#include <algorithm>
#include <dynmesh/topology.hpp>
#include <dynmesh/types.hpp>
#include <limits>
#include <span>
#include <vector>

#include "base/stored_numbers.hpp"
#include "base/training_frames.hpp"
#include "base/workers.hpp"
#include "frame/generations.hpp"
#include "shape/error_bars.hpp"
#include "shape/rotations.hpp"
#include "shape/shape_system.hpp"
#include "surface_fit/cloth.hpp"
#include "surface_fit/constants.hpp"
#include "surface_fit/membrane.hpp"
#include "surface_fit/rest_shape.hpp"
#include "surface_fit/surface_rows.hpp"
#include "surface_fit/surface_system.hpp"

namespace dynmesh {

/// The positions X of a frame minimise |W^1/2 (K X - Q m)|^2 with the energies of a membrane, of
/// ties between components, of the rows of measured points, and of landmarks;
/// docs/reference/tracking.md has the equation. K and Q are those of method detail, m is between
/// the shapes of the last frame and of frame 0, and W is 1 where the shape does not yield.
class NonrigidStep {
 public:
  using Field = std::span<const Vector3<double>>;

  /// `topology`, `workers`, `constants` and `materials` must outlive this object. `training` is a
  /// training sequence, or empty. `epsilon` is that of the type in which positions are given.
  NonrigidStep(std::span<const Triangle> faces, const Topology& topology, Workers& workers,
               const TrackingConstants& constants, Field first_frame, double mean_edge,
               std::span<const Material> materials, const TrainingFrames& training,
               bool has_uncertainty, double epsilon);

  /// Lets the shape yield from now on where |K X - Q m| is more than so many times its median: it
  /// resists with as much force there as at the limit (Huber 1964), since bodies bend at joints.
  void yield_beyond(double medians) {
    yield_beyond_ = medians;
    std::ranges::fill(system_.resistance(), 1.0);
  }
  /// Begins a frame from what was remembered last, whatever was found since.
  void begin_frame();
  /// Factors the preconditioner of the next steps for these rows and landmarks, or for others with
  /// about their weights times `factor`.
  void factorize(std::span<const SurfaceRow> rows, std::span<const Landmark> landmarks,
                 double factor) {
    surface_system_.factorize(rows, landmarks, factor);
  }
  /// Finds Q for X, and then X for the rows and landmarks. Without any, X stays and the result is
  /// false. If `mode_weights` is not 0, the modes of the training sequence are fitted first, with
  /// so many times the weights of the rows.
  bool take(std::span<const SurfaceRow> rows, std::span<const Landmark> landmarks,
            double mode_weights, std::span<Vector3<double>> x);

  /// Keeps the rows to which the last step drew X, for the standard errors of the frame.
  void keep_rows(std::span<const SurfaceRow> rows, Field x);
  /// Finds the standard errors of X, and does not throw. `generations` are those of its vertices;
  /// those without a point may be off by `unseen` beside that.
  void measure_errors(const Generations& generations, Field x, double unseen);

  /// Remembers the shape of the completed frame.
  void remember(Field completed);
  /// The shape of frame 0 is then wanted.
  void forget_shape() { std::ranges::copy(rest_.shape(), shape_.begin()); }

  [[nodiscard]] const RestShape& rest() const { return rest_; }
  [[nodiscard]] const Rotations& rotations() const { return rotations_; }
  [[nodiscard]] const ErrorBars& error_bars() const { return error_bars_; }

  /// What later frames depend on, beside frame 0 and the last frame.
  void write_memory(Writer& writer) const;
  /// Reads what `write_memory` wrote, with the last frame. Refuses other numbers, and is of no use
  /// then.
  void read_memory(Reader& reader, Field last);

 private:
  /// What a frame changes and `begin_frame` returns to.
  template <class Self, class Visit>
  static void fields(Self& self, const Visit& visit) {
    for (auto& q : self.rotations_.quaternions()) visit(std::span(&q.w, 4));
    RestShape::fields(self.rest_, visit);
  }
  void keep();
  void find_forces(Field x);
  void find_resistance();
  void observe_planes(std::span<const SurfaceRow> rows, Field x);
  void fit_modes(std::span<const SurfaceRow> rows, double mode_weights, Field x);
  void find_shape(Field frame);

  const Topology& topology_;
  std::span<const Material> materials_;
  ShapeSystem system_;
  Rotations rotations_;
  Rounding rounding_;
  std::vector<Vector3<double>> shape_;  // m = Q^T K X of the last frame
  RestShape rest_;
  ErrorBars error_bars_;
  Membrane membrane_;
  SurfaceSystem surface_system_;
  double yield_beyond_ = std::numeric_limits<double>::infinity();
  std::vector<double> remembered_;  // the fields, as of the last frame

  // Of the current frame:
  Anchors anchors_;
  std::vector<Vector3<double>> wanted_, turned_;
  std::vector<Vector3<double>> kx_;      // and then Q m - K X
  std::vector<Vector3<double>> planes_;  // the mean normals of the rows
  std::vector<Vector3<double>> forces_;
};

}  // namespace dynmesh
