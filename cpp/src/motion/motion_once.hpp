/// The estimate of the paper: a satellite moves like the known vertices of its cell (section 3,
/// "Geometry Completion Based on Topological Characteristics").
#pragma once

#include <cstddef>
#include <cstdint>
#include <dynmesh/topology.hpp>
#include <dynmesh/types.hpp>
#include <span>
#include <vector>

#include "mesh/estimator.hpp"
#include "mesh/generations.hpp"

namespace dynmesh {

/// Allocates memory only in the constructor. The time of an iteration is linear in the number of
/// edges of the satellites that it estimates.
template <class Real>
class Motion final : public Estimator<Real> {
 public:
  using typename Estimator<Real>::Frame;

  /// `cells` must outlive this object. `first_frame` is frame 0. With `revisit`, every iteration
  /// estimates all satellites reached so far; otherwise each is estimated once, when it is reached.
  /// `extra_iterations` >= 0 is the number of iterations after the one that reaches the last
  /// satellite; without `revisit` they have no effect.
  Motion(const Cells& cells, Frame first_frame, bool revisit, Index extra_iterations);

  Index estimate(Frame previous, std::span<Vector3<Real>> points,
                 std::span<const std::uint8_t> known, Generations& generations) override;
  void remember(Frame /*completed*/) override {}

 private:
  /// w d and w: a motion vector times its weight, and the weight.
  struct alignas(4 * sizeof(Real)) Weighted {
    Vector3<Real> motion;
    Real weight{};

    void add(Real factor, const Weighted& other) {
      motion = motion + factor * other.motion;
      weight += factor * other.weight;
    }
  };
  /// A satellite neighbour i of satellite j.
  struct Neighbour {
    std::uint32_t row;  ///< of vertex i, in the order of Generations::satellites
    Real s;             ///< s_ij
  };

  [[nodiscard]] Real inverse_squared_distance(const Vector3<Real>& a, const Vector3<Real>& b) const;
  void gather(Frame previous, std::span<const Vector3<Real>> points,
              const Generations& generations);
  [[nodiscard]] Weighted weighted_sum(std::size_t row, Index iteration) const;

  const Cells& cells_;
  bool revisit_;
  Index extra_iterations_;
  Real mean_edge_;  // h of frame 0

  // Row j of each belongs to the j-th satellite of the frame.
  std::vector<Weighted> anchor_sums_;  // sum of s_ij d_i and of s_ij over the anchors i
  std::vector<Index> row_ends_;        // row j of neighbours_ ends at row_ends_[j + 1]
  std::vector<Neighbour> neighbours_;  // satellites i in the cell of j
  std::vector<Weighted> estimates_;    // w_j d_j before the iteration
  std::vector<Weighted> next_;         // w_j d_j after the iteration
  std::vector<std::uint32_t> row_of_;  // (k,) the row of each satellite
};

}  // namespace dynmesh
