/// Method detail: completion that keeps the shape of frame 0, turned with the motion.
#pragma once

#include <cstdint>
#include <dynmesh/estimator.hpp>
#include <dynmesh/generations.hpp>
#include <dynmesh/topology.hpp>
#include <dynmesh/types.hpp>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include "blend.hpp"
#include "detail_operator.hpp"
#include "masked_factor.hpp"
#include "operator_kernels.hpp"
#include "rotations.hpp"
#include "workers.hpp"

namespace dynmesh {

/// The positions X of a frame minimise |K X - Q (m_prev + b (m_first - m_prev) + c u)|^2, anchors
/// fixed. K, of frame 0, sees detail; m_first and m_prev, in the axes of frame 0, are the detail of
/// frame 0 and of the last frame, and u how it has been changing; Q turns them into this frame; b
/// and c are what the anchors say.
///
/// With noise, anchors are not fixed but drawn to where they were observed, by lambda times their
/// squared distance; lambda weighs the errors of the shape, as they were found in frames before,
/// against those of the anchors.
///
/// Allocates in `reset`, and in `estimate` where the factor is larger than all before.
template <class Real>
class Detail final : public Estimator<Real> {
 public:
  using typename Estimator<Real>::Frame;
  using typename Estimator<Real>::Memory;

  /// `topology` and `workers` must outlive this object.
  /// `noise`: the standard deviation of the anchors, positive; none: they are exact.
  Detail(std::vector<Triangle> faces, const Topology& topology, std::optional<double> noise,
         Workers& workers);

  void reset(Frame first_frame) override;
  Index estimate(Frame previous, std::span<Vector3<Real>> points,
                 std::span<const std::uint8_t> known, Generations& generations) override;
  void remember(Frame completed) override;
  [[nodiscard]] Memory memory() const override;
  [[nodiscard]] std::size_t memory_rows() const override { return x_.size(); }
  [[nodiscard]] bool accepts(const Memory& memory) const override;
  void recall(const Memory& memory, Frame completed) override;
  [[nodiscard]] StageReport stages() const override { return report_; }

 private:
  /// One or three Vector3 for each vertex.
  using Field = std::vector<Vector3<double>>;

  // lambda, times the squared mean edge of frame 0.
  static constexpr double first_weight = 10;
  static constexpr double least_weight = 1e-3;
  static constexpr double largest_weight = 1e3;

  [[nodiscard]] Index n_vertices() const { return static_cast<Index>(x_.size()); }
  void take(Frame frame);
  void apply_operator(const Field& x, int fields, Field& products);
  void solve(int fields, Field& steps);
  void take_anchors(Frame previous, std::span<const Vector3<Real>> points,
                    const Generations& generations);
  void move_smoothly();
  void take_step();
  void fit_rotations();
  void solve_for(std::span<const double> blend, double change);
  Blend solve_for_blend();
  void find_residuals(std::size_t v, const auto& visit) const;
  void weigh_anchors();
  void take_memory();
  void learn_change();

  std::vector<Triangle> faces_;
  const Topology& topology_;
  Workers& workers_;
  const OperatorKernels& kernels_;
  Rotations rotations_;
  LocalBlend local_blend_;
  Generations next_generations_;          // those of a frame until nothing can fail any more
  DetailOperator operator_;               // K
  std::unique_ptr<MaskedFactor> factor_;  // of K^T K at what is not fixed
  std::vector<std::uint8_t> solved_;      // (k,) what is not fixed: satellites, noisy anchors
  std::vector<std::uint8_t> is_anchor_;   // (k,)
  std::vector<double> counts_;            // (k,) 1 in components that hold an anchor, else 0

  Field first_memory_;  // m_first
  Field memory_;        // m_prev, m_first - m_prev and u
  Field last_memory_;   // m_prev before the last frame
  Field turned_;        // Q times all three
  Field observed_;      // the anchors as they were given
  Field x_;             // X
  Field kx_;            // K X
  Field target_;        // what K X is to be
  Field residual_;      // M^-1/2 times what K^T is multiplied with, one or three fields
  Field solution_;      // one or three fields for each row solved, in the order of elimination
  Field step_;          // one field for each vertex, that of the last solve where it was solved for
  Field steps_;         // three, 0 where a vertex is fixed
  Field k_step_;        // K times one of them
  std::vector<BlendFit> blend_fits_;
  std::vector<double> anchor_weights_;  // (k,) lambda at noisy anchors, else 0
  std::optional<double> noise_;
  double mean_edge_ = 0;  // of frame 0
  double weight_ = 0;     // lambda, in the unit of K
  StageReport report_;
};

}  // namespace dynmesh
