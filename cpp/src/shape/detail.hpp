/// Method detail: completion that preserves the shape of frame 0, rotated with the motion.
/// `complete` follows docs/method.md, "Detail: completion that preserves the shape".
#pragma once

#include <cstddef>
#include <dynmesh/frame_report.hpp>
#include <dynmesh/settings.hpp>
#include <dynmesh/types.hpp>
#include <optional>
#include <span>
#include <vector>

#include "base/lender.hpp"
#include "base/workers.hpp"
#include "shape/blend.hpp"
#include "shape/cluster_rotations.hpp"
#include "shape/detail_operator.hpp"
#include "shape/error_bars.hpp"
#include "shape/first_order.hpp"
#include "shape/growth.hpp"
#include "shape/memory.hpp"
#include "shape/model.hpp"
#include "shape/rotations.hpp"
#include "shape/shape_fit.hpp"
#include "shape/shape_system.hpp"

namespace dynmesh {

/// The positions X of a frame minimise |K X - Q (m + b (m_first - m) + c u)|^2 with the anchors
/// fixed. K is an operator built from frame 0 that extracts the detail. m_first and m are the
/// detail of frame 0 and of the last frame in the axes of frame 0, u is the recent change of m, and
/// Q rotates them into the current frame. b and c are fitted to the anchors. In holes, what known
/// rows show beyond this goes on.
///
/// With noise, anchors are not fixed. Instead, lambda times their squared distance from the
/// observed positions is added to the energy. lambda balances the errors of the shape, estimated in
/// earlier frames, with the noise of the anchors.
///
/// Surfaces that keep the lengths of their edges rather than their detail take a share of
/// first-order steps.
///
/// This finds frames and holds no results of theirs: each step returns what it makes, and what
/// later frames depend on is in the memory of the next frame. Allocates memory in the constructor,
/// and in `complete` if the factor is larger than all earlier ones.
class Detail {
 public:
  /// `model`, `modes`, `leaders` and `workers` must outlive this object. `modes` are those of the
  /// model, or those that are learned. `settings` are those of the completer.
  Detail(const ShapeModel& model, const Modes& modes, const Settings& settings, Leaders& leaders,
         Workers& workers);

  /// What is remembered of frame 0.
  void begin(Memory& memory) const;

  /// Completes the satellites of the frame `next.last` from its anchors and from the memory of the
  /// frame before. `next.generations` are those of the frame. Disconnected vertices are not
  /// changed, and neither are anchors, unless they are noisy. Returns how the surface has turned.
  /// Throws std::bad_alloc if memory is exhausted.
  Lent<ClusterRotations> complete(const Memory& memory, Memory& next, FrameReport& report);

  /// Completes the next memory by what the frame `next.last` shows when all of it is completed.
  void remember(const Memory& memory, Memory& next, StageReport& report);

 private:
  /// What brings X, the shape that it is to have, closest to the three terms of the shape.
  struct Steps {
    explicit Steps(std::size_t k) : wanted(k), steps(k), k_steps(k) {}

    std::vector<ShapeTerms> wanted;   // Q m, Q (m_first - m) and Q u
    std::vector<ShapeTerms> steps;    // towards these
    std::vector<ShapeTerms> k_steps;  // K times the steps
  };

  Lent<ClusterRotations> turn(const Memory& memory, const Anchors& anchors, Memory& next,
                              StageReport& report);
  std::size_t solve(const Memory& memory, Anchors& anchors, ShapeFactor& factor, Index farthest,
                    Memory& next, FrameReport& report);
  void fit_rotations(Field positions, Memory& next, StageReport& report);
  LentField in_first_sizes(const Memory& memory, const Memory& next, Anchors& anchors);
  LentField copy_of(Field field);
  LentField detail_of(Field positions);
  LentField turned(std::span<const Quaternion> q, Field shape);
  LentField moved_to(Field shape, Field x, Field kx, ShapeFactor& factor);
  Lent<Steps> steps_towards(const Memory& memory, std::span<const Quaternion> q, Field x, Field kx,
                            ShapeFactor& factor);
  void add_modes(const AddedShape& added, Steps& to) const;
  LentField shape_of(const Memory& memory, const AddedShape& added, std::span<const double> b,
                     double c);
  void continue_seen(const Memory& next, Field kx, std::span<Vector3> shape);
  [[nodiscard]] ShapeTerms terms(const Memory& memory, std::size_t v) const {
    return {memory.m[v], model_.first_shape[v] - memory.m[v], memory.completion.u[v]};
  }
  [[nodiscard]] double size_of(std::size_t v, std::span<const double> sizes) const {
    return sizes[at(model_.topology.component[v])];
  }
  [[nodiscard]] double next_lambda(double lambda, std::span<const double> sizes, Field x, Field kx,
                                   Field shape, const Anchors& anchors) const;

  const ShapeModel& model_;
  std::optional<double> noise_;
  Workers& workers_;
  ShapeSystem system_;
  Rotations rotations_;
  AnchorRotations anchor_rotations_;
  ShapeFit fit_;
  ErrorBars error_bars_;
  FirstOrder first_order_;
  Growth growth_;

  Lender<Anchors> anchors_;
  Lender<MaskedFactor> factors_;
  FieldLender fields_;
  Lender<Steps> steps_;
  Lender<std::vector<double>> numbers_;
};

}  // namespace dynmesh
