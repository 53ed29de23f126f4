/// The estimate of the paper, by the loops of sweeps.hpp: a satellite moves like the known vertices
/// of its cell (section 3, "Geometry Completion Based on Topological Characteristics"), and is
/// estimated again in every iteration.
#pragma once

#include <cstdint>
#include <dynmesh/topology.hpp>
#include <dynmesh/types.hpp>
#include <span>
#include <vector>

#include "kernels/kernels.hpp"
#include "mesh/estimator.hpp"
#include "mesh/generations.hpp"
#include "support/workers.hpp"

namespace dynmesh {

/// Allocates memory only in the constructor.
template <class Real>
class Motion final : public Estimator<Real> {
 public:
  using typename Estimator<Real>::Frame;

  /// `workers` must outlive this object. `first_frame` is frame 0. `extra_iterations` >= 0 is the
  /// number of iterations after the one that reaches the last satellite. The result does not depend
  /// on the number of threads. Refuses meshes for which the 32-bit offsets of the loops do not
  /// suffice: more than 268 million vertices in float, or 134 million in double.
  Motion(const Cells& cells, Frame first_frame, Index extra_iterations, Workers& workers,
         const Sweeps<Real>& sweeps = best_kernels().sweeps<Real>());

  Index estimate(Frame previous, std::span<Vector3<Real>> points,
                 std::span<const std::uint8_t> known, Generations& generations) override;

 private:
  Index sweep(Index t);
  [[nodiscard]] Index n_chunks() const { return static_cast<Index>(chunks_.size()); }

  Workers& workers_;
  const Sweeps<Real>& sweeps_;
  Index extra_iterations_;
  SweepData<Real> data_{};

  std::vector<std::uint32_t> neighbours_;
  std::vector<std::uint8_t> valence_;
  std::vector<Index> wide_;
  std::vector<std::uint32_t> wide_neighbours_;
  std::vector<Vector3<Real>> wide_weights_;  // one for each four slots
  std::vector<Vector3<Real>> weights_;       // two quads per vertex
  std::vector<Vector3<Real>> before_;
  std::vector<Vector3<Real>> after_;
  std::vector<Real> visits_;
  std::vector<Index> rows_;
  std::vector<Rows> chunks_;
};

/// Method motion without `revisit`: each satellite is estimated once, when it is reached.
///
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

 private:
  const Cells& cells_;
  Index extra_iterations_;
  Real mean_edge_;                      // h of frame 0
  std::vector<Vector3<Real>> motions_;  // (k,) d of anchors and of satellites that are estimated
};

}  // namespace dynmesh
