/// Method detail: completion that keeps the shape of frame 0, turned with the motion. The method is
/// described in docs/method.md, whose steps `estimate` follows.
#pragma once

#include <cstdint>
#include <dynmesh/topology.hpp>
#include <dynmesh/types.hpp>
#include <optional>
#include <span>
#include <vector>

#include "detail/anchors.hpp"
#include "detail/blend.hpp"
#include "detail/constants.hpp"
#include "detail/memory.hpp"
#include "detail/rotations.hpp"
#include "detail/shape_system.hpp"
#include "generations/estimator.hpp"
#include "generations/generations.hpp"
#include "support/workers.hpp"

namespace dynmesh {

/// The positions X of a frame minimise |K X - Q (m + b (m_first - m) + c u)|^2, anchors fixed. K,
/// of frame 0, sees detail; m_first and m, in the axes of frame 0, are the detail of frame 0 and of
/// the last frame, and u how it has been changing; Q turns them into this frame; b and c are what
/// the anchors say.
///
/// With noise, anchors are not fixed but drawn to where they were observed, by lambda times their
/// squared distance; lambda weighs the errors of the shape, as they were found in frames before,
/// against those of the anchors.
///
/// Allocates in `reset`, and in `estimate` where the factor is larger than all before.
template <class Real>
class Detail final : public Estimator<Real> {
 public:
  using typename Estimator<Real>::Frame;
  using typename Estimator<Real>::Memory;

  /// `topology` and `workers` must outlive this object.
  /// `noise`: the standard deviation of the anchors, positive; none: they are exact.
  Detail(std::vector<Triangle> faces, const Topology& topology, std::optional<double> noise,
         Workers& workers, const DetailConstants& constants = {});

  void reset(Frame first_frame) override;
  Index estimate(Frame previous, std::span<Vector3<Real>> points,
                 std::span<const std::uint8_t> known, Generations& generations) override;
  void remember(Frame completed) override;
  [[nodiscard]] Memory memory() const override;
  [[nodiscard]] std::size_t memory_rows() const override { return topology_.cells.size(); }
  [[nodiscard]] bool accepts(const Memory& memory) const override;
  void recall(const Memory& memory, Frame completed) override;
  [[nodiscard]] StageReport stages() const override { return report_; }

 private:
  using Field = std::span<const Vector3<double>>;

  /// X and its detail K X, both (k,), in the workspace.
  struct Positions {
    std::span<Vector3<double>> x;
    std::span<Vector3<double>> kx;
  };

  Field in_workspace(Frame frame);
  const Anchors& hold(Field previous, std::span<const Vector3<Real>> points,
                      const Generations& generations);
  Positions move_smoothly(Field previous, const Anchors& anchors);
  Field turned_shapes(const Positions& positions);
  ResidualField find_directions(const Positions& positions, Field shapes, const Anchors& anchors);
  Positions take_directions(Positions positions, const ResidualField& directions,
                            const Blend& blend);
  Positions take_shape(Positions positions, Field shape, const Anchors& anchors);
  Field blended(Field shapes, std::span<const double> b, double c);
  void weigh_anchors(const Positions& positions, Field shape, const Anchors& anchors);
  Field detail_turned_back(Field completed);

  std::vector<Triangle> faces_;
  const Topology& topology_;
  DetailConstants constants_;
  ShapeSystem system_;
  Rotations rotations_;
  LocalBlend local_blend_;
  ShapeMemory memory_;
  std::optional<double> noise_;
  Generations next_generations_;  // of a frame, until nothing can fail any more
  double mean_edge_ = 1;          // of frame 0
  double lambda_ = 0;             // in the unit of K
  StageReport report_;

  /// What the steps of a frame return views of; nothing in here lasts from frame to frame.
  struct Workspace {
    Workspace(std::size_t n_vertices, bool is_noisy);

    Anchors anchors;
    std::vector<Vector3<double>> x;
    std::vector<Vector3<double>> kx;
    std::vector<Vector3<double>> shape;    // (k,)
    std::vector<Vector3<double>> k_steps;  // (3 k,)
  };
  Workspace workspace_;
};

}  // namespace dynmesh
