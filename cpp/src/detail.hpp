/// Method detail: completion that keeps the shape of frame 0, turned with the motion.
#pragma once

#include <chrono>
#include <cstdint>
#include <dynmesh/estimator.hpp>
#include <dynmesh/generations.hpp>
#include <dynmesh/topology.hpp>
#include <dynmesh/types.hpp>
#include <memory>
#include <span>
#include <vector>

#include "blend.hpp"
#include "detail_operator.hpp"
#include "masked_factor.hpp"
#include "rotations.hpp"
#include "workers.hpp"

namespace dynmesh {

/// The positions X of a frame minimise |K X - Q (m_prev + b (m_first - m_prev))|^2, anchors fixed.
/// K, of frame 0, sees detail; m_first and m_prev, in the axes of frame 0, are the detail of frame
/// 0 and of the last frame; Q turns them into this frame; b is what the anchors say.
///
/// Allocates in `reset`, and in `estimate` where the factor is larger than all before.
template <class Real>
class Detail final : public Estimator<Real> {
 public:
  using typename Estimator<Real>::Frame;
  using typename Estimator<Real>::Memory;

  /// `topology` and `workers` must outlive this object.
  Detail(std::vector<Triangle> faces, const Topology& topology, Workers& workers);

  void reset(Frame first_frame) override;
  Index estimate(Frame previous, std::span<Vector3<Real>> points,
                 std::span<const std::uint8_t> known, Generations& generations) override;
  void remember(Frame completed) override;
  [[nodiscard]] Memory memory() const override;
  void recall(const Memory& memory, Frame completed) override;
  [[nodiscard]] StageReport stages() const override { return report_; }

 private:
  using Positions = std::vector<Vector3<double>>;

  void take(Frame frame);
  void apply_operator(const Positions& x, Positions& kx);
  void apply_transposed(const Positions& r, Positions& ktr);
  void turn_memory();
  void solve_round();
  void solve_local_blend();

  std::vector<Triangle> faces_;
  const Topology& topology_;
  Workers& workers_;
  Rotations rotations_;
  LocalBlend local_blend_;
  DetailOperator operator_;               // K
  std::unique_ptr<MaskedFactor> factor_;  // of K^T K at the satellites
  std::vector<std::uint8_t> solved_;      // (k,) the satellites
  std::vector<std::uint8_t> counts_;      // (k,) vertices of components that hold an anchor

  Positions first_memory_;  // m_first
  Positions memory_;        // m_prev
  Positions x_;             // X
  Positions kx_;            // K X
  Positions turned_;        // Q m_prev
  Positions change_;        // Q (m_first - m_prev)
  Positions step_;          // right-hand sides and solutions: towards the shape of the last frame
  Positions change_step_;   // and what a unit of b adds
  Positions r0_;            // residuals, as in blend.hpp
  Positions r1_;
  Positions scaled_;  // M^-1/2 times something
  StageReport report_;
};

}  // namespace dynmesh
