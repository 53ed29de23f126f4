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

#include "base/workers.hpp"
#include "frame/generations.hpp"
#include "kernels/kernels.hpp"
#include "linear/masked_factor.hpp"
#include "shape/detail_operator.hpp"
#include "shape/memory.hpp"
#include "shape/model.hpp"
#include "shape/shape_system.hpp"

namespace dynmesh {

/// Moves the completed vertices of a frame of detail by a share of the first-order step. In some
/// frames anchors are left out, and what both predict of them decides on the shares. Components
/// that have shown little so far form one group with a common share; each of the others is a group
/// of its own.
///
/// The step is one iteration of as-rigid-as-possible deformation (Sorkine and Alexa 2007) of the
/// last frame G. R_i is the rotation that best maps the edges of vertex i in G to those in X. The
/// free vertices then minimise sum_ij w_ij |X_i - X_j - (R_i + R_j) (G_i - G_j) / 2|^2 with all
/// others fixed. The edges and the weights w are those of C, so the result does not depend on the
/// scale of the mesh.
///
/// Allocates memory in the constructor, and in a test if the factor of the system is larger than
/// all earlier ones. All sums run in the order of the vertices, so they are the same for any number
/// of threads.
class FirstOrder {
 public:
  /// `model` and `workers` must outlive this object.
  FirstOrder(const ShapeModel& model, Workers& workers, bool is_noisy);

  /// A frame that detail has completed, (k,) each.
  struct Frame {
    Field last;            ///< the completed frame before
    std::span<Vector3> x;  ///< the completed positions
    Field shape;           ///< the shape that K X was to have
  };
  /// Moves the satellites in `frame.x`, and returns their mean share. Factors the system anew for a
  /// test. `memory` counts this frame already.
  double improve(const Frame& frame, const Anchors& anchors, const Generations& generations,
                 ShapeSystem& system, GainMemory& memory);

 private:
  using Component = GainMemory::Component;
  /// The anchors of a component, and how many of them are left out.
  struct Drawn {
    double anchors = 0;
    double left_out = 0;
  };

  [[nodiscard]] static bool is_due(std::uint64_t frame);
  bool draw(const Generations& generations, std::uint64_t frame);
  void leave_out(const Anchors& anchors, const Generations& generations);
  void test(const Frame& frame, const Anchors& anchors, const Generations& generations,
            ShapeSystem& system, std::vector<Component>& components);
  void learn(Field first_order, Field observed, double rounding,
             std::vector<Component>& components);
  [[nodiscard]] static double best_share(const Gains& gains);
  double mix(const Frame& frame, const Generations& generations, ShapeSystem& system,
             std::span<const Component> components);
  std::span<Vector3> find_step(Field positions, Field last, std::span<Vector3> scratch);
  void fit_rotations(Field positions, Field last);
  [[nodiscard]] Vector3 residual(std::size_t v, Field positions) const;

  const ShapeModel& model_;
  const Topology& topology_;
  Workers& workers_;
  DetailOperator laplacian_;  // L = diag(sum_j w_ij) - W; its scale is 1
  MaskedFactor factor_;
  std::vector<double> sizes_;  // of the components, in vertices

  // Of one frame:
  Anchors kept_;  // the anchors that are not left out
  std::vector<Drawn> drawn_;
  std::vector<Index> nearby_;
  std::vector<std::uint8_t> is_left_out_, is_free_;
  std::vector<Vector3> of_detail_;  // the predictions of detail
  std::vector<Gains> newest_;
  // Of the step:
  std::vector<Vector3> edges_;
  std::vector<Quaternion> quaternions_;
  std::vector<Covariance> covariances_;
};

}  // namespace dynmesh
