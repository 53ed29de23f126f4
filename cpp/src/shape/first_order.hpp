/// A second prediction beside that of detail, for surfaces that keep their edges; see
/// docs/method.md, "The first-order step". It keeps the edges of the last frame, as far as
/// rotations can.
#pragma once

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

/// Tells by how much the completed vertices of a frame of detail follow the first-order step. In
/// each frame a few anchors are left out, and what both predict of them decides on the shares.
/// Components that have shown little so far form one group with a common share; each of the others
/// is a group of its own.
///
/// The step is one iteration of as-rigid-as-possible deformation (Sorkine and Alexa 2007) of the
/// last frame, (13). The edges and the weights w are those of C, so the result does not depend on
/// the scale of the mesh.
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
    double share = 0;           ///< the mean share of the first-order step over the satellites
  };
  /// Finds by how much the satellites move, and what their components have shown, in `memory`,
  /// which counts this frame already.
  Lent<Improvement> improve(const Frame& frame, const Generations& generations, GainMemory& memory);

 private:
  using Component = GainMemory::Component;
  /// The anchors that are left out, and with them the satellites around them.
  struct Test {
    explicit Test(std::size_t k) : is_nearby(k) {}

    std::vector<Index> left_out, nearby;
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
  void learn(const Frame& frame, const Test& test, Field of_detail, Field step,
             std::vector<Component>& components);
  [[nodiscard]] static double best_share(const Gains& gains);
  LentField find_step(MaskedFactor& factor, std::span<const std::uint8_t> is_free, Field positions,
                      Field last);
  void fit_rotations(std::span<const Index> rows, Field positions, Field last);
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
  std::vector<std::uint8_t> is_free_;
  std::vector<std::uint8_t> is_beside_;  // whether the rotation of a vertex is needed
  std::vector<Vector3> edges_;
  std::vector<Quaternion> quaternions_;
  std::vector<Covariance> covariances_;
};

}  // namespace dynmesh
