/// The shape of a tracked surface, and the step that brings the surface to measured points while
/// this shape resists.
#pragma once

#include <dynmesh/topology.hpp>
#include <dynmesh/types.hpp>
#include <limits>
#include <optional>
#include <span>
#include <vector>

#include "base/workers.hpp"
#include "shape/error_bars.hpp"
#include "shape/memory.hpp"
#include "shape/model.hpp"
#include "shape/rotations.hpp"
#include "shape/shape_fit.hpp"
#include "shape/shape_system.hpp"
#include "surface_fit/cloth.hpp"
#include "surface_fit/constants.hpp"
#include "surface_fit/learned_ties.hpp"
#include "surface_fit/membrane.hpp"
#include "surface_fit/surface_rows.hpp"
#include "surface_fit/surface_system.hpp"

namespace dynmesh {

/// The positions X of a frame minimise |W^1/2 (K X - Q m)|^2 with the energies of a membrane, of
/// ties between components, of the rows of measured points, and of landmarks;
/// docs/reference/tracking.md has the equation. K and Q are those of method detail, m is between
/// the shapes of the last frame and of frame 0, and W is 1 where the shape does not yield.
class NonrigidStep {
 public:
  /// All arguments must outlive this object.
  NonrigidStep(const ShapeModel& model, std::span<const Triangle> faces, Workers& workers,
               const TrackingConstants& constants, std::span<const Material> materials,
               bool has_uncertainty);

  /// What is remembered of frame 0.
  void begin(Memory& memory) const;
  [[nodiscard]] LearnedTies& ties() { return ties_; }
  [[nodiscard]] const LearnedTies& ties() const { return ties_; }

  /// What `take` takes.
  struct Draw {
    std::span<const SurfaceRow> rows;
    std::span<const Landmark> landmarks;
    /// The shape yields where |K X - Q m| is more than so many times its median: it resists with as
    /// much force there as at the limit (Huber 1964), since bodies bend at joints.
    double yields_beyond = std::numeric_limits<double>::infinity();
    double settled = 0;  ///< the share of the error at which the solution ends
    /// If it is not 0, the modes of the training sequence are fitted first, with so many times the
    /// weights of the rows.
    double mode_weights = 0;
  };
  /// Finds Q for X, in `next`, and how strongly ties hold X. `departures` are those of the last
  /// frame.
  void turn_to(Field x, std::span<const double> departures, Memory& next);
  /// Factors the preconditioner of the next steps for these rows and landmarks, or for others with
  /// about their weights times `factor`.
  void factorize(std::span<const SurfaceRow> rows, std::span<const Landmark> landmarks,
                 double factor) {
    surface_system_.factorize(rows, landmarks, factor);
  }
  /// Finds X for the rows and landmarks, after `turn_to`; (k,) `m` is the shape of the last frame.
  /// `next` holds Q, and what was remembered of modes. Without rows and landmarks, X stays and the
  /// result is false.
  bool take(const Draw& draw, Field m, std::span<Vector3> x, Memory& next);

  [[nodiscard]] bool has_errors() const { return error_bars_.exist(); }
  /// Keeps the rows to which the last step drew X, for the standard errors of the frame.
  void prepare_errors(std::span<const SurfaceRow> rows, Field x);
  /// Finds the standard errors of X, after `prepare_errors`, and does not throw. `next.generations`
  /// are those of the frame; vertices without a point may be off by `unseen` beside that.
  void measure_errors(const Memory& memory, Field x, double unseen, Memory& next);

  /// Finds the rotations of a frame in place of those of an earlier one.
  void fit_rotations(Field frame, std::span<Quaternion> q) { rotations_.fit(frame, q); }
  /// Finds the rotations and the shape of a frame in place of those of `memory`.
  void remember(Field frame, Memory& memory);
  /// Finds the rest shape p = m_first + k B a, in the axes of frame 0: m_first is the detail of
  /// frame 0, B are the modes of a training sequence, a are the coefficients that the last frame
  /// supports and k, 0 to 1, how far the training sequence is used. See docs/method.md, "Training
  /// frames". Without training, p is m_first.
  void find_rest_shape(const FitMemory& fit);
  [[nodiscard]] Field rest_shape() const { return rest_; }  ///< (k,) p

 private:
  void find_forces(Field x, std::span<const Quaternion> q, double yields_beyond);
  void find_resistance(double yields_beyond);
  void observe_planes(std::span<const SurfaceRow> rows, Field x);
  void fit_modes(const Draw& draw, Field m, Field x, Memory& next);

  const ShapeModel& model_;
  const Topology& topology_;
  Workers& workers_;
  std::span<const Material> materials_;
  Rotations rotations_;
  ShapeFit fit_;
  ErrorBars error_bars_;
  LearnedTies ties_;
  SurfaceSystem surface_system_;
  Membrane membrane_;
  std::optional<ShapeSystem> of_planes_;  // for modes and standard errors, if there are any

  // Of the current frame:
  Anchors anchors_;
  std::vector<Vector3> rest_;  // p
  std::vector<Vector3> wanted_, turned_;
  std::vector<Vector3> kx_;      // and then Q m - K X
  std::vector<Vector3> planes_;  // the mean normals of the rows
  std::vector<Vector3> forces_;
};

}  // namespace dynmesh
