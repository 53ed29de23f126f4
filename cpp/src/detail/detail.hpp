/// Method detail: completion that preserves the shape of frame 0, rotated with the motion.
/// `estimate` follows the steps described in docs/method.md.
#pragma once

#include <cstdint>
#include <dynmesh/topology.hpp>
#include <dynmesh/types.hpp>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "detail/anchors.hpp"
#include "detail/blend.hpp"
#include "detail/constants.hpp"
#include "detail/error_bars.hpp"
#include "detail/first_order.hpp"
#include "detail/learned_modes.hpp"
#include "detail/memory.hpp"
#include "detail/modes.hpp"
#include "detail/rotations.hpp"
#include "detail/rounding.hpp"
#include "detail/shape_fit.hpp"
#include "detail/shape_system.hpp"
#include "generations/estimator.hpp"
#include "generations/generations.hpp"
#include "support/stored_numbers.hpp"
#include "support/workers.hpp"

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
/// Allocates memory in `reset`, and in `estimate` if the factor is larger than all earlier ones.
class Detail final : public Estimator<double> {
 public:
  /// `faces`, `topology`, `workers` and `training` must outlive this object. `noise` is the
  /// standard deviation of the anchors, positive; without it, they are exact. `training` is a
  /// training sequence, or empty. `learns` is whether modes are made of completed frames, which
  /// requires that `training` is empty. `epsilon` is that of the type in which positions are given.
  Detail(std::span<const Triangle> faces, const Topology& topology, std::optional<double> noise,
         Workers& workers, const DetailConstants& constants, const TrainingFrames& training,
         bool learns, bool has_uncertainty, double epsilon);

  void reset(Frame first_frame) override;
  Index estimate(Frame previous, std::span<Vector3<double>> points,
                 std::span<const std::uint8_t> known, Generations& generations) override;
  void remember(Frame completed) override;
  void write_memory(Writer& writer) const override;
  [[nodiscard]] std::size_t memory_size() const override;
  void read_memory(Reader& reader, Frame completed) override;
  [[nodiscard]] std::span<const double> standard_error() const override {
    return error_bars_.of_vertices();
  }
  [[nodiscard]] StageReport stages() const override { return report_; }

  /// What a state keeps, beside the error bars.
  template <class Self, class Visit>
  static void fields(Self& self, const Visit& visit) {
    for (auto& q : self.rotations_.quaternions()) visit(std::span(&q.w, 4));
    ShapeMemory::fields(self.memory_, visit);
    visit(self.lambda_);
    FirstOrderShares::fields(self.first_order_.shares(), visit);
    if (!self.training_.empty()) ShapeFit::fields(self.rest_fit_, visit);
    if (self.learned_) LearnedModes::fields(*self.learned_, visit);
  }

 private:
  using Field = std::span<const Vector3<double>>;

  /// X and its detail K X, both (k,), in the workspace.
  struct Positions {
    std::span<Vector3<double>> x;
    std::span<Vector3<double>> kx;
  };
  /// What the blend of a frame is found from, with a fitted shape in the place of m_first or m.
  struct Fitted {
    ResidualField directions;
    std::span<const ShapeTerms> shapes;  // m, m_first - m and u
    FittedModes found = {};              // nothing without modes
  };

  Field in_workspace(Frame frame);
  const Anchors& hold(Field previous, std::span<const Vector3<double>> points,
                      const Generations& generations);
  Positions move_smoothly(Field previous, const Anchors& anchors);
  void fit_rotations(Field positions);
  std::span<const ShapeTerms> turn(std::span<const ShapeTerms> shapes);
  ResidualField find_directions(const Positions& positions, std::span<const ShapeTerms> turned,
                                const Anchors& anchors);
  Fitted fit_modes(const ResidualField& directions, const Generations& generations);
  Fitted add_modes(ShapeFit& fit, ResidualField directions, const Generations& generations);
  Positions take_directions(Positions positions, const ResidualField& directions,
                            const Blend& blend);
  Positions take_step(Positions positions, Field step);
  Field blended(std::span<const ShapeTerms> turned, std::span<const double> b, double c);
  Positions take_shape(Positions positions, Field shape, const Anchors& anchors);
  double take_first_order(Field previous, const Positions& positions, Field shape,
                          const Anchors& anchors, const Generations& generations);
  void weigh_anchors(const Positions& positions, Field shape, const Anchors& anchors);
  Field detail_turned_back(Field completed);

  std::span<const Triangle> faces_;
  const Topology& topology_;
  DetailConstants constants_;
  ShapeSystem system_;
  Rotations rotations_;
  LocalBlend local_blend_;
  ShapeMemory memory_;
  const TrainingFrames& training_;
  ShapeFit rest_fit_;
  bool learns_;
  std::unique_ptr<LearnedModes> learned_;  // null before `reset`, and if it does not learn
  ErrorBars error_bars_;
  FirstOrder first_order_;
  std::optional<double> noise_;
  Generations next_generations_;  // of the current frame, until nothing can throw any more
  double mean_edge_ = 1;          // the mean edge length of frame 0
  double epsilon_;
  Rounding rounding_;
  double lambda_ = 0;  // in the unit of K
  StageReport report_;

  /// The arrays, (k,), to which the steps of a frame return views. None is kept from frame to
  /// frame.
  struct Workspace {
    Workspace(std::size_t n_vertices, bool is_noisy, bool has_modes);

    Anchors anchors;
    std::vector<Vector3<double>> x, kx, shape;
    std::vector<ShapeTerms> turned, k_steps;
    std::vector<ShapeTerms> steps, shapes;  // with modes
  };
  Workspace workspace_;
  Workers& workers_;
};

}  // namespace dynmesh
