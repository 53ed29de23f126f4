/// A second prediction beside that of detail, for surfaces that keep their edges; see
/// docs/method.md, "Edges".
#pragma once

#include <cstdint>
#include <dynmesh/topology.hpp>
#include <dynmesh/types.hpp>
#include <span>
#include <vector>

#include "detail/anchors.hpp"
#include "detail/constants.hpp"
#include "detail/first_order_shares.hpp"
#include "detail/first_order_step.hpp"
#include "detail/rounding.hpp"
#include "detail/shape_system.hpp"
#include "generations/generations.hpp"
#include "support/workers.hpp"

namespace dynmesh {

/// Moves the completed vertices of a frame of detail by a share of the first-order step. What both
/// predict of anchors left out decides on the shares.
class FirstOrder {
 public:
  using Field = std::span<const Vector3<double>>;

  /// The arguments but the last must outlive this object.
  FirstOrder(const Topology& topology, Workers& workers, const FirstOrderConstants& constants,
             bool is_noisy);

  /// Begins the sequence with the operator `k` of frame 0.
  void reset(const DetailOperator& k, const Rounding& rounding);

  /// A frame that detail has completed, (k,) each.
  struct Frame {
    Field last;                    ///< the completed frame before
    std::span<Vector3<double>> x;  ///< the completed positions
    Field kx;                      ///< K X
    Field shape;                   ///< the shape that K X was to have
  };
  /// Moves the satellites in `frame.x`, and returns their mean share. Factors the system anew for a
  /// test. If memory is exhausted, the frame stays as it is.
  double improve(const Frame& frame, const Anchors& anchors, const Generations& generations,
                 ShapeSystem& system);

  /// Of what later frames depend on.
  [[nodiscard]] FirstOrderShares& shares() { return shares_; }
  [[nodiscard]] const FirstOrderShares& shares() const { return shares_; }

 private:
  void test(const Frame& frame, const Anchors& anchors, const Generations& generations,
            ShapeSystem& system);
  void leave_out(const Anchors& anchors, const Generations& generations);
  double mix(const Frame& frame, const Generations& generations, ShapeSystem& system);

  const Cells& cells_;
  const FirstOrderConstants& constants_;
  FirstOrderStep step_;
  FirstOrderShares shares_;
  Rounding rounding_;

  // Of one frame:
  Anchors kept_;  // the anchors that are not left out
  std::vector<Index> nearby_;
  std::vector<std::uint8_t> is_left_out_, is_free_;
  std::vector<Vector3<double>> of_detail_;  // the predictions of detail
};

}  // namespace dynmesh
