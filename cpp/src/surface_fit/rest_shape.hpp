/// The shape to which a tracked surface returns: that of frame 0, or the one in which a training
/// sequence shows it.
#pragma once

#include <dynmesh/topology.hpp>
#include <dynmesh/types.hpp>
#include <span>
#include <vector>

#include "base/workers.hpp"
#include "shape/modes.hpp"
#include "shape/rotations.hpp"
#include "shape/shape_fit.hpp"
#include "shape/shape_system.hpp"

namespace dynmesh {

/// The rest shape p = m_first + k B a, in the axes of frame 0: m_first is the detail of frame 0, B
/// are the modes of a training sequence, a are the coefficients that the last frame supports and k,
/// 0 to 1, how far the training sequence is used. See docs/method.md, "Training frames". Without
/// training, p is m_first, and nothing is allocated for modes.
class RestShape {
 public:
  using Field = std::span<const Vector3<double>>;

  /// `cells` and `workers` must outlive this object. `modes` are those of a training sequence, if
  /// there is one. (k,) `first_shape` is m_first.
  RestShape(const Cells& cells, Workers& workers, bool is_trained, Modes modes, Field first_shape);

  /// Whether there is a training sequence, although it may have no modes for this frame 0.
  [[nodiscard]] bool is_trained() const { return is_trained_; }

  /// p: (k,).
  [[nodiscard]] Field shape() const { return shape_; }
  [[nodiscard]] double prior_weight() const { return prior_weight_; }
  /// The share of the residual that the modes explain.
  [[nodiscard]] double prior_share() const { return prior_share_; }

  /// Fits the rest shape by what the anchors say of the positions X of a frame. (k,) `shape` is m,
  /// that of the last frame, and `rounding` the mean square of rounding errors of a shape. `system`
  /// is factored for the anchors, `rotations` are those of X.
  void fit(Field x, Field shape, const Anchors& anchors, double rounding, ShapeSystem& system,
           const Rotations& rotations);

  /// What later frames depend on. Call `recall` after other numbers took its place.
  template <class Self, class Visit>
  static void fields(Self& self, const Visit& visit) {
    if (!self.is_trained()) return;
    visit(self.prior_weight_);
    visit(self.prior_share_);
    ShapeFit::fields(self.fit_, visit);
  }
  void recall();

 private:
  void set_shape();

  bool is_trained_;
  ShapeFit fit_;
  double prior_weight_ = 0;
  double prior_share_ = 0;
  std::vector<Vector3<double>> first_;  // m_first
  std::vector<Vector3<double>> shape_;
};

}  // namespace dynmesh
