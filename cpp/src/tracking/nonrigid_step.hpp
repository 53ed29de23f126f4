/// The shape of a tracked surface, and the step that brings the surface to measured points while
/// this shape resists.
#pragma once

#include <cstdint>
#include <dynmesh/topology.hpp>
#include <dynmesh/types.hpp>
#include <memory>
#include <span>
#include <vector>

#include "detail/anchors.hpp"
#include "detail/constants.hpp"
#include "detail/error_bars.hpp"
#include "detail/rotations.hpp"
#include "detail/rounding.hpp"
#include "detail/shape_system.hpp"
#include "detail/surface_rows.hpp"
#include "generations/generations.hpp"
#include "support/stored_numbers.hpp"
#include "support/workers.hpp"
#include "tracking/constants.hpp"
#include "tracking/membrane.hpp"
#include "tracking/rest_shape.hpp"
#include "tracking/ties.hpp"

namespace dynmesh {

/// The positions X of a frame minimise |K X - Q m|^2 with the energies of a membrane, of ties
/// between components, of the rows of measured points, and of landmarks; docs/reference/tracking.md
/// has the equation. K and Q are those of method detail, m is between the shapes of the last frame
/// and of frame 0. The rows tie the three coordinates together, so the system has 3 k unknowns, but
/// N plus the weights of the rows at the vertices, which has k, is a good preconditioner, even with
/// the weights of another step: a few steps of conjugate gradients suffice.
///
/// Allocates memory in `reset`, and in a step if the factor is larger than all earlier ones.
class NonrigidStep {
 public:
  using Field = std::span<const Vector3<double>>;

  /// `topology`, `workers` and `constants` must outlive this object. `training` is a training
  /// sequence, or empty. `epsilon` is that of the type in which positions are given.
  NonrigidStep(const Topology& topology, Workers& workers, const TrackingConstants& constants,
               TrainingFrames training, bool has_uncertainty, double epsilon);

  /// Begins a sequence. If it throws, nothing has changed.
  /// (k,) `is_cloth` are the vertices whose lengths are kept.
  void reset(std::span<const Triangle> faces, Field first_frame, double mean_edge,
             std::span<const std::uint8_t> is_cloth);

  /// Begins a frame, which `undo_frame` forgets again.
  void begin_frame();
  void undo_frame();
  /// A position to which a vertex is drawn.
  struct Landmark {
    std::size_t vertex = 0;
    Vector3<double> target;
    double weight = 0;
  };

  /// Factors the preconditioner of the next steps for these rows and landmarks, or for others with
  /// about the same weights.
  void factorize(const SurfaceRows& rows, std::span<const Landmark> landmarks);
  /// Finds Q for X, and then X for the rows and landmarks. Without any, X stays and the result is
  /// false. If `mode_weights` is not 0, the modes of the
  /// training sequence are fitted first, with so many times the weights of the rows.
  bool take(SurfaceRows& rows, std::span<const Landmark> landmarks, double mode_weights,
            std::span<Vector3<double>> x);

  /// Keeps the rows of the last step for the standard errors of the frame.
  void keep_rows(const SurfaceRows& rows, Field x);
  /// Finds the standard errors of X. `generations` are those of its vertices.
  void measure_errors(const Generations& generations, Field x);

  /// Remembers the shape of the completed frame.
  void remember(Field completed);

  [[nodiscard]] const RestShape& rest() const { return rest_; }
  [[nodiscard]] const Clusters& clusters() const { return rotations_.clusters(); }
  [[nodiscard]] const ErrorBars& error_bars() const { return error_bars_; }

  /// What later frames depend on, beside frame 0 and the last frame.
  struct Memory {
    std::vector<Quaternion> rotations;
    RestShape::Memory rest;
    Reader errors{{}};
  };
  [[nodiscard]] std::size_t memory_size() const;
  void write_memory(Writer& writer) const;
  /// Refuses a memory that `write_memory` cannot have written.
  [[nodiscard]] Memory read_memory(Reader& reader) const;
  void recall(Memory memory, Field last);

 private:
  void hold(std::span<const Landmark> landmarks);
  void find_forces(SurfaceRows& rows, std::span<const Landmark> landmarks, Field x);
  void observe_planes(const SurfaceRows& rows, Field x);
  void fit_modes(const SurfaceRows& rows, double mode_weights, Field x);

  const Topology& topology_;
  Workers& workers_;
  const TrackingConstants& constants_;
  DetailConstants detail_constants_;
  ShapeSystem system_;
  Rotations rotations_;
  double epsilon_;
  Rounding rounding_;
  RestShape rest_;
  ErrorBars error_bars_;
  std::unique_ptr<Membrane> membrane_;
  std::vector<double> pulls_;  // (k,) the share of frame 0 in the wanted shape
  std::vector<Tie> ties_;
  std::vector<Vector3<double>> tied_;   // what the ties keep, in frame 0
  std::vector<Vector3<double>> shape_;  // m = Q^T K X of the last frame
  std::vector<Quaternion> last_rotations_;

  // Of the current frame:
  Anchors anchors_;
  std::vector<Vector3<double>> wanted_, turned_, kx_;
  std::vector<Vector3<double>> planes_;  // the mean normals of the rows
  std::vector<Vector3<double>> forces_;
  std::vector<double> held_;
  std::vector<double> factored_weights_;  // those of the preconditioner
};

}  // namespace dynmesh
