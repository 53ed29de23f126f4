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
#include "generations/generations.hpp"
#include "support/stored_numbers.hpp"
#include "support/workers.hpp"
#include "tracking/boundary_reach.hpp"
#include "tracking/constants.hpp"
#include "tracking/measurement.hpp"
#include "tracking/membrane.hpp"
#include "tracking/rest_shape.hpp"

namespace dynmesh {

/// The positions X of a frame minimise |K X - Q m|^2 + sum_i w_i (n_i . (q_i - X_i))^2. K and Q are
/// those of method detail, m is between the shapes of the last frame and of frame 0, and q_i, n_i
/// is the measured point, with its normal, of vertex i. The planes tie the three coordinates
/// together, so the system has 3 k unknowns, but N + w, which has k, is a good preconditioner, even
/// with the w of another step: a few steps of conjugate gradients suffice.
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
  /// Lets the next step factor its system, even if its components are those of the last one.
  void forget_factor() { is_factored_ = false; }

  /// A position to which a vertex is drawn.
  struct Landmark {
    std::size_t vertex = 0;
    Vector3<double> target;
    double weight = 0;
  };

  /// What was measured, (k,) each, and the weights of correspondences without any distance.
  struct Measured {
    std::span<Correspondence> found;
    std::span<const Reach> reaches;  ///< empty without cloth
    double weight = 0;
    double cloth_weight = 0;
    std::span<const Landmark> landmarks = {};
  };
  /// Finds Q for X, and then X for what was measured. Correspondences of components that have
  /// hardly any get the weight 0; if all have, X stays and the result is false. `fits_modes` is
  /// whether the modes of the training sequence are fitted.
  bool take(const Measured& measured, bool fits_modes, std::span<Vector3<double>> x);
  /// (k,) 1 for the vertices of components that the last step moved.
  [[nodiscard]] std::span<const std::uint8_t> moved() const { return anchors_.is_solved; }

  /// Keeps the correspondences of the last step for the standard errors of the frame.
  void keep_planes(std::span<const Correspondence> found, Field x);
  /// Finds the standard errors of X. `generations` are those of its vertices.
  void measure_errors(const Generations& generations, Field x);

  /// Remembers the shape of the completed frame.
  void remember(Field completed);

  [[nodiscard]] const RestShape& rest() const { return rest_; }
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
  bool choose_components(const Measured& measured);
  void hold(std::span<const Landmark> landmarks);
  void pull_cloth(const Measured& measured, Field x);
  void observe_planes(std::span<const Correspondence> found, Field x);
  void fit_modes(std::span<const Correspondence> found, Field x);

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
  std::unique_ptr<Membrane> membrane_;  // of cloth, if there is any
  std::vector<std::uint8_t> is_cloth_;
  std::vector<Vector3<double>> shape_;  // m = Q^T K X of the last frame
  std::vector<Quaternion> last_rotations_;

  // Of the current frame:
  Anchors anchors_;
  std::vector<Vector3<double>> wanted_, turned_, kx_;
  std::vector<Vector3<double>> planes_;     // the normals of the correspondences
  std::vector<Vector3<double>> outward_;    // of cloth
  std::vector<Vector3<double>> forces_;     // of cloth and landmarks
  std::vector<double> held_;                // the weights of landmarks
  std::vector<double> found_in_;            // the correspondences of each component, weighed
  std::vector<double> factored_weights_;    // those of the preconditioner
  std::vector<Vector3<double>> last_step_;  // which the next one often continues
  bool is_factored_ = false;
};

}  // namespace dynmesh
