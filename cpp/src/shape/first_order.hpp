/// Further predictions beside that of detail, for surfaces that keep their edges; see
/// docs/method.md, "The first-order steps". They keep the edges of the last frame or of frame 0, as
/// far as rotations can.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <dynmesh/topology.hpp>
#include <dynmesh/types.hpp>
#include <span>
#include <vector>

#include "base/lender.hpp"
#include "base/workers.hpp"
#include "frame/generations.hpp"
#include "kernels/kernels.hpp"
#include "linear/masked_factor.hpp"
#include "shape/detail_operator.hpp"
#include "shape/memory.hpp"
#include "shape/model.hpp"

namespace dynmesh {

/// Tells by how much the completed vertices of a frame of detail follow first-order steps. In each
/// frame a few anchors are left out, and what all predict of them decides on the step and its share
/// at vertices that are about as far from anchors as they. Components that have shown little so far
/// form one group with a common share; each of the others is a group of its own.
///
/// A step is some rounds of as-rigid-as-possible deformation (Sorkine and Alexa 2007) of a frame,
/// (13). The edges and the weights w are those of C, so the result does not depend on the scale of
/// the mesh.
///
/// Allocates memory only in the constructor. All sums run in the order of the vertices, so they are
/// the same for any number of threads.
class FirstOrder {
 public:
  /// `model` and `workers` must outlive this object.
  FirstOrder(const ShapeModel& model, Workers& workers);

  /// A frame that detail has completed, (k,) each.
  struct Frame {
    Field last;      ///< the completed frame before
    Field x;         ///< the completed positions
    Field shape;     ///< the shape that K X was to have
    Field observed;  ///< the positions of the anchors
  };
  struct Improvement {
    explicit Improvement(std::size_t k) : move(k) {}

    std::vector<Vector3> move;  ///< (k,) of X, 0 but for satellites; without a share, anything
    double share = 0;           ///< the mean share of the steps over the satellites
  };
  /// Finds by how much the satellites move, and what their components have shown, in `memory`,
  /// which counts this frame already.
  Lent<Improvement> improve(const Frame& frame, const Generations& generations, GainMemory& memory);

 private:
  /// Rounds that keep the edges of a frame.
  struct Step {
    bool is_of_last;  // of the last frame, not of frame 0
    bool goes_on;     // from the step before, not from the result of detail
    int rounds;
  };
  static constexpr std::array<Step, Gains::n_steps> steps_ = {
      {{true, false, 1}, {true, true, 4}, {false, false, 3}}};
  /// What a component takes of the steps.
  struct Choice {
    double near_share = 0;  // near anchors, of this step
    std::size_t near_step = 0;
    double rings = 1;  // of the anchors that told it from others, their mean
    double share = 0;  // of the first step, farther from anchors
  };
  /// The anchors that are left out, and with them the satellites around them.
  struct Test {
    explicit Test(std::size_t k) : is_nearby(k) {}

    std::vector<Index> left_out, nearby;
    std::vector<double> rings;            // from those left out to the nearest anchor
    std::vector<std::uint8_t> is_nearby;  // (k,)
  };
  /// Of a component.
  struct Drawn {
    double size = 0;  // in vertices
    double anchors = 0;
    double share = 0;  // of them that is left out
    double sum = 0;    // of the shares so far; where it reaches 1, an anchor is left out
    double rings = 0;  // of satellites around it that move
  };

  Lent<Test> leave_out(const Generations& generations, std::uint64_t frame);
  LentField predict(const Frame& frame, const Test& test);
  [[nodiscard]] Vector3 pull(std::size_t v, const Frame& frame) const;
  double rings_to_anchor(Index v, const Generations& generations, const Test& test);
  void learn(const Frame& frame, const Test& test, std::vector<Gains>& components);
  void choose(std::span<const Gains> components);
  [[nodiscard]] static double share_of(std::size_t step, Index rings, const Choice& choice);
  [[nodiscard]] static Choice best_of(const Gains& gains);
  [[nodiscard]] bool is_needed(std::size_t step) const;
  void take(const Step& step, MaskedFactor& factor, std::span<const std::uint8_t> is_free,
            const Frame& frame, std::span<Vector3> positions);
  void fit_rotations(std::span<const Index> rows, Field positions, Field kept);
  [[nodiscard]] Vector3 residual(std::size_t v, Field positions) const;

  const ShapeModel& model_;
  const Topology& topology_;
  Workers& workers_;
  DetailOperator laplacian_;          // L = diag(sum_j w_ij) - W; its scale is 1
  MaskedFactor factor_;               // of L at the satellites
  MaskedFactor nearby_l_, nearby_n_;  // of L and N around the anchors that are left out
  std::vector<Index> order_;          // (k,) in which anchors are drawn

  FieldLender fields_;
  Lender<Test> tests_;
  Lender<Improvement> improvements_;
  // Buffers:
  std::vector<Drawn> drawn_;
  std::vector<Gains> newest_;
  std::vector<Choice> choices_;
  std::vector<Index> reached_;  // from one that is left out
  std::vector<std::uint8_t> is_reached_;
  std::vector<std::uint8_t> is_free_;
  std::vector<std::uint8_t> is_beside_;  // whether the rotation of a vertex is needed
  std::vector<Vector3> edges_;
  std::vector<Quaternion> quaternions_;
  std::vector<Covariance> covariances_;
};

}  // namespace dynmesh
