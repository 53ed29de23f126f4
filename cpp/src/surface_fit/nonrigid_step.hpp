/// The step that brings a tracked surface to measured points while its shape resists.
#pragma once

#include <dynmesh/topology.hpp>
#include <dynmesh/types.hpp>
#include <limits>
#include <span>
#include <vector>

#include "base/workers.hpp"
#include "shape/memory.hpp"
#include "shape/model.hpp"
#include "shape/rotations.hpp"
#include "shape/shape_fit.hpp"
#include "surface_fit/constants.hpp"
#include "surface_fit/learned_ties.hpp"
#include "surface_fit/materials.hpp"
#include "surface_fit/membrane.hpp"
#include "surface_fit/surface_rows.hpp"
#include "surface_fit/surface_system.hpp"

namespace dynmesh {

/// What draws a surface in a step, and how.
struct StepInput : Pulls {
  /// The shape yields where |K X - Q m| is more than so many times its median: it resists with as
  /// much force there as at the limit (Huber 1964), since bodies bend at joints.
  double yields_beyond = std::numeric_limits<double>::infinity();
  SolverLimits solution;
  /// If it is not 0, the modes of the training sequence are fitted first, with so many times the
  /// weights of the rows.
  double mode_weights = 0;
};

/// The positions X of a frame minimise |W^1/2 (K X - Q m)|^2 with the energies of a membrane, of
/// ties between components, of the rows of measured points, and of landmarks;
/// docs/reference/tracking.md has the equation. K and Q are those of method detail, m is between
/// the shapes of the last frame and of frame 0, and W is 1 where the shape does not yield.
class NonrigidStep {
 public:
  /// All arguments must outlive this object.
  NonrigidStep(const ShapeModel& model, std::span<const Triangle> faces, Workers& workers,
               const TrackingConstants& constants, std::span<const Material> materials);

  /// What is remembered of frame 0.
  void begin(Memory& memory) const;
  [[nodiscard]] const LearnedTies& ties() const { return ties_; }
  /// The memory of a factor of N with the membrane, for one at a time.
  [[nodiscard]] Lender<MaskedFactor>& factors() { return surface_system_.factors(); }

  /// Finds Q for X, in `next`, and how strongly ties hold X. `departures` are those of the last
  /// frame.
  [[nodiscard]] WeightedTies turn_to(Field x, std::span<const double> departures, Memory& next);
  /// The preconditioner of steps with these pulls, or with others of about their weights, those of
  /// the rows times `factor`.
  [[nodiscard]] Lent<MaskedFactor> preconditioner(const Pulls& pulls, double factor) {
    return surface_system_.preconditioner(pulls, factor);
  }
  /// Finds X for the pulls; (k,) `m` is the shape of the last frame. `next` holds Q, and what was
  /// remembered of modes. Without rows and landmarks, X stays and the result is false.
  bool step(const StepInput& input, MaskedFactor& preconditioner, Field m, std::span<Vector3> x,
            Memory& next);

  /// Finds the rotations of a frame in place of those of an earlier one.
  void fit_rotations(Field frame, std::span<Quaternion> q) { rotations_.fit(frame, q); }
  /// Finds the rotations and the shape of a frame in place of those of `memory`.
  void remember(Field frame, Memory& memory);
  /// (k,) the rest shape p = S m_first + k B a, in the axes of frame 0: S is the size of a
  /// component, m_first is the detail of frame 0, B are the modes of a training sequence, a are the
  /// coefficients that the last frame supports and k, 0 to 1, how far the training sequence is
  /// used. See docs/method.md, "Training frames". Without training, p is m_first.
  [[nodiscard]] std::vector<Vector3> rest_shape(const Memory& memory);
  /// (k,) Q m, the shape that K X is to have, where `last` is that of the last frame.
  [[nodiscard]] std::vector<Vector3> wanted_shape(Field last, const Memory& next);

 private:
  [[nodiscard]] std::vector<Vector3> forces(Field x, Field departures,
                                            std::span<const double> resistance,
                                            std::span<const Tie> ties,
                                            std::span<const Quaternion> q);
  /// S m_first of a vertex.
  [[nodiscard]] Vector3 grown(std::size_t v, const Memory& memory) const {
    return memory.sizes[at(model_.topology.component[v])] * model_.first_shape[v];
  }
  void fit_modes(const StepInput& input, const MaskedFactor& preconditioner, Field m, Field x,
                 Memory& next);

  const ShapeModel& model_;
  Workers& workers_;
  const TrackingConstants& constants_;
  std::span<const Material> materials_;
  Rotations rotations_;
  ShapeFit fit_;
  LearnedTies ties_;
  SurfaceSystem surface_system_;
  Membrane membrane_;
};

}  // namespace dynmesh
