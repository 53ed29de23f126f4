/// Method detail: completion that preserves the shape of frame 0, rotated with the motion.
/// `estimate` follows the steps described in docs/method.md.
#pragma once

#include <cstddef>
#include <dynmesh/frame_report.hpp>
#include <dynmesh/settings.hpp>
#include <dynmesh/types.hpp>
#include <optional>
#include <span>
#include <vector>

#include "base/workers.hpp"
#include "shape/blend.hpp"
#include "shape/detail_operator.hpp"
#include "shape/error_bars.hpp"
#include "shape/first_order.hpp"
#include "shape/growth.hpp"
#include "shape/increments.hpp"
#include "shape/memory.hpp"
#include "shape/model.hpp"
#include "shape/rotations.hpp"
#include "shape/shape_fit.hpp"
#include "shape/shape_system.hpp"

namespace dynmesh {

/// The positions X of a frame minimise |K X - Q (m + b (m_first - m) + c u)|^2 with the anchors
/// fixed. K is an operator built from frame 0 that extracts the detail. m_first and m are the
/// detail of frame 0 and of the last frame in the axes of frame 0, u is the recent change of m, and
/// Q rotates them into the current frame. b and c are fitted to the anchors.
///
/// With noise, anchors are not fixed. Instead, lambda times their squared distance from the
/// observed positions is added to the energy. lambda balances the errors of the shape, estimated in
/// earlier frames, with the noise of the anchors.
///
/// Surfaces that keep the lengths of their edges rather than their detail take a share of a
/// first-order step.
///
/// This finds frames and holds no results of theirs: those are in the memory of the next frame,
/// which a frame writes and the next one reads. Allocates memory in the constructor, and in
/// `estimate` if the factor is larger than all earlier ones.
class Detail {
 public:
  /// `model`, `modes`, `leaders` and `workers` must outlive this object. `modes` are those of the
  /// model, or those that are learned. `settings` are those of the completer.
  Detail(const ShapeModel& model, const Modes& modes, const Settings& settings, Leaders& leaders,
         Workers& workers);

  /// What is remembered of frame 0.
  void begin(Memory& memory) const;

  /// Estimates the satellites of the frame `next.last` from its anchors and from the memory of the
  /// frame before. `next.generations` are those of the frame. Disconnected vertices are not
  /// changed, and neither are anchors, unless they are noisy. Returns the number of iterations.
  /// Throws std::bad_alloc if memory is exhausted.
  std::size_t estimate(const Memory& memory, Memory& next, StageReport& report);

  /// Completes the next memory by what the frame `next.last` shows when all of it is completed.
  void remember(const Memory& memory, Memory& next, StageReport& report);

  /// (components,) how each component has turned in the last `estimate`, as unit quaternions.
  [[nodiscard]] std::span<const Quaternion> rotations_of_components() const {
    return increments_.of_components();
  }

 private:
  void fit_rotations(Field positions, Memory& next, StageReport& report);
  ResidualField find_directions(const Memory& memory, std::span<const Quaternion> q);
  void add_modes(const ResidualField& directions, Memory& next);
  [[nodiscard]] ShapeTerms terms(const Memory& memory, std::size_t v) const {
    return {memory.m[v], model_.first_shape[v] - memory.m[v], memory.completion.u[v]};
  }
  [[nodiscard]] double size_of(std::size_t v, std::span<const double> sizes) const {
    return sizes[at(model_.topology.component[v])];
  }
  void move_to_shape();
  void add_turn_errors(const Memory& memory, Memory& next, bool are_turned);
  [[nodiscard]] double next_lambda(double lambda, std::span<const double> sizes) const;

  const ShapeModel& model_;
  std::optional<double> noise_;
  Workers& workers_;
  ShapeSystem system_;
  Rotations rotations_;
  Increments increments_;
  LocalBlend local_blend_;
  ShapeFit fit_;
  ErrorBars error_bars_;
  FirstOrder first_order_;
  Growth growth_;

  std::vector<Turn> still_;  // (components,)
  // Of one frame, (k,) each:
  Anchors anchors_;
  std::vector<Vector3> last_;    // the frame before, in the sizes of frame 0
  std::vector<Vector3> x_, kx_;  // X and K X
  std::vector<Vector3> shape_;   // the shape that K X is to have
  std::vector<Vector3> move_;    // towards that shape
  std::vector<ShapeTerms> turned_, steps_, k_steps_;
};

}  // namespace dynmesh
