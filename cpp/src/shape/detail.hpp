/// Method detail: completion that preserves the shape of frame 0, rotated with the motion.
/// `estimate` follows the steps described in docs/method.md.
#pragma once

#include <cstdint>
#include <dynmesh/settings.hpp>
#include <dynmesh/topology.hpp>
#include <dynmesh/types.hpp>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "base/stored_numbers.hpp"
#include "base/training_frames.hpp"
#include "base/workers.hpp"
#include "frame/estimator.hpp"
#include "frame/generations.hpp"
#include "shape/blend.hpp"
#include "shape/detail_operator.hpp"
#include "shape/error_bars.hpp"
#include "shape/first_order.hpp"
#include "shape/increments.hpp"
#include "shape/rotations.hpp"
#include "shape/shape_fit.hpp"
#include "shape/shape_library.hpp"
#include "shape/shape_system.hpp"

namespace dynmesh {

/// The positions X of a frame minimise |K X - Q (m + b (m_first - m) + c u)|^2 with the anchors
/// fixed. K is an operator built from frame 0 that extracts the detail. m_first and m are the
/// detail of frame 0 and of the last frame in the axes of frame 0, u is the recent change of m, and
/// Q rotates them into the current frame. b and c are fitted to the anchors.
///
/// With noise, anchors are not fixed. Instead, lambda times their squared distance from the
/// observed positions is added to the energy. lambda balances the errors of the shape, estimated in
/// earlier frames, with the noise of the anchors.
///
/// Surfaces that keep the lengths of their edges rather than their detail take a share of a
/// first-order step.
///
/// Allocates memory in the constructor, and in `estimate` if the factor is larger than all earlier
/// ones.
class Detail final : public Estimator {
 public:
  /// `topology` and `workers` must outlive this object. `training` are frames of a training
  /// sequence, or none if the settings learn. `epsilon` is that of the type in which positions are
  /// given.
  Detail(Frame first_frame, std::span<const Triangle> faces, const Topology& topology,
         const TrainingFrames& training, Workers& workers, const Settings& settings,
         double epsilon);

  Index estimate(Frame previous, std::span<Vector3<double>> points,
                 std::span<const std::uint8_t> known, Generations& generations) override;
  void remember(Frame completed) override;
  void write_memory(Writer& writer) const override;
  void read_memory(Reader& reader, Frame completed) override;
  [[nodiscard]] std::span<const Quaternion> rotations_of_components() const override {
    return increments_.of_components();
  }
  [[nodiscard]] std::span<const double> standard_error() const override {
    return error_bars_.of_vertices();
  }
  [[nodiscard]] StageReport stages() const override { return report_; }

  /// What a state keeps, beside the error bars.
  template <class Self, class Visit>
  static void fields(Self& self, const Visit& visit) {
    for (auto& q : self.rotations_.quaternions()) visit(std::span(&q.w, 4));
    for (auto& shape : self.shapes_) visit(std::span(&shape.change.x, 3));
    visit(self.lambda_);
    FirstOrder::fields(self.first_order_, visit);
    if (self.is_trained_ || self.library_) ShapeFit::fields(self.fit_, visit);
    if (!self.library_) return;
    ShapeLibrary::fields(*self.library_, visit);
    visit(self.n_evident_);
  }

 private:
  using Field = std::span<const Vector3<double>>;

  void turn_with_anchors(Frame previous, const Generations& generations);
  void fit_rotations(Field positions);
  ResidualField find_directions();
  FittedModes add_modes(ResidualField& directions);
  void move_to_shape();
  void weigh_anchors();
  void learn();
  Field detail_turned_back(Frame completed);

  const Topology& topology_;
  Workers& workers_;
  std::optional<double> noise_;
  double mean_edge_;  // of frame 0
  ShapeSystem system_;
  Rounding rounding_;
  Rotations rotations_;
  Increments increments_;
  LocalBlend local_blend_;
  bool is_trained_;  // although the training may have no modes for this frame 0
  ShapeFit fit_;     // of the modes of the training, or of those that are learned
  std::unique_ptr<ShapeLibrary> library_;  // null if it does not learn
  ErrorBars error_bars_;
  FirstOrder first_order_;
  Generations next_generations_;  // of the current frame, until nothing can throw any more
  StageReport report_;

  // Kept from frame to frame:
  std::vector<Vector3<double>> first_shape_;  // m_first
  std::vector<ShapeTerms> shapes_;            // m, m_first - m and u
  double lambda_;                             // in the unit of K
  std::uint64_t n_evident_ = 0;               // the number of frames with anchors, if it learns

  // Of one frame, (k,) each:
  Anchors anchors_;
  std::vector<Vector3<double>> x_, kx_;  // X and K X
  std::vector<Vector3<double>> shape_;   // the shape that K X is to have
  std::vector<ShapeTerms> turned_, k_steps_;
  std::vector<ShapeTerms> steps_, fitted_;  // with modes: the steps, and shapes with what is fitted
};

}  // namespace dynmesh
