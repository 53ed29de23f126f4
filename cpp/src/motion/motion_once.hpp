/// Method motion without `revisit`: each satellite is estimated once, when it is reached.
#pragma once

#include <cstdint>
#include <dynmesh/topology.hpp>
#include <dynmesh/types.hpp>
#include <span>
#include <vector>

#include "mesh/estimator.hpp"
#include "mesh/generations.hpp"

namespace dynmesh {

/// Allocates memory only in the constructor. The time is linear in the number of edges.
template <class Real>
class MotionOnce final : public Estimator<Real> {
 public:
  using typename Estimator<Real>::Frame;

  /// `cells` must outlive this object. `first_frame` is frame 0. `extra_iterations` are counted,
  /// but have no effect.
  MotionOnce(const Cells& cells, Frame first_frame, Index extra_iterations);

  Index estimate(Frame previous, std::span<Vector3<Real>> points,
                 std::span<const std::uint8_t> known, Generations& generations) override;
  void remember(Frame /*completed*/) override {}

 private:
  const Cells& cells_;
  Index extra_iterations_;
  Real mean_edge_;                      // h of frame 0
  std::vector<Vector3<Real>> motions_;  // (k,) d of anchors and of satellites that are estimated
};

}  // namespace dynmesh
