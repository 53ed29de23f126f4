/// Some of the vertices of a surface, and how all others follow them.
#pragma once

#include <dynmesh/topology.hpp>
#include <dynmesh/types.hpp>
#include <optional>
#include <span>
#include <vector>

#include "base/lender.hpp"
#include "base/training_frames.hpp"
#include "base/workers.hpp"
#include "mesh/decimation.hpp"
#include "shape/memory.hpp"
#include "shape/model.hpp"
#include "shape/rotations.hpp"
#include "shape/shape_system.hpp"
#include "surface_fit/constants.hpp"
#include "surface_fit/materials.hpp"

namespace dynmesh {

/// A coarse mesh of a surface. All other vertices follow from its own as a completion does from
/// these as anchors: with the shape of the last frame, turned as the coarse mesh around them.
class CoarseSurface {
 public:
  /// `whole`, `materials` and `workers` must outlive this object.
  CoarseSurface(DecimatedMesh mesh, const ShapeModel& whole, std::span<const Material> materials,
                Workers& workers);

  [[nodiscard]] std::size_t size() const { return mesh_.vertices.size(); }
  [[nodiscard]] const std::vector<Triangle>& faces() const { return mesh_.faces; }
  [[nodiscard]] const Topology& topology() const { return topology_; }
  [[nodiscard]] Field first_frame() const { return first_frame_; }
  /// The coarse vertex that is nearest to a vertex, counted in edges.
  [[nodiscard]] std::size_t nearest(Index vertex) const { return at(nearest_[at(vertex)]); }

  /// The constants with which the coarse mesh resists points as the whole surface does with these.
  [[nodiscard]] TrackingConstants constants_of(TrackingConstants constants) const;
  /// (components,) of the coarse mesh.
  [[nodiscard]] std::vector<Material> materials() const;
  /// (coarse vertices,) each, the positions of the coarse vertices in these frames.
  [[nodiscard]] TrainingFrames chosen(const TrainingFrames& frames) const;
  /// Copies what a memory of the whole surface holds of the coarse vertices, but for the shape.
  void choose(const Memory& memory, Memory& coarse) const;

  /// (coarse vertices,) the means of the colours of the vertices that follow each.
  [[nodiscard]] SurfaceColours colours(const SurfaceColours& of_whole) const;

  /// (k,) X for the positions and rotations of the coarse mesh in `next`, which were those in
  /// `last` in the frame of `memory`. `rest` is the rest shape. `found` then holds the rotations
  /// with which X was found.
  [[nodiscard]] std::vector<Vector3> restored(const Memory& last, const Memory& next,
                                              const Memory& memory, Field rest, Memory& found);

 private:
  [[nodiscard]] double ratio() const;

  const ShapeModel& whole_;
  std::span<const Material> materials_;
  Workers& workers_;
  DecimatedMesh mesh_;
  Topology topology_;
  std::vector<Vector3> first_frame_;
  std::vector<Index> nearest_;  // (k,)
  // The anchors are the same in all frames. Without a factor that is kept, each frame would factor
  // nearly all of N.
  Anchors anchors_;
  ShapeSystem system_;
  Lender<MaskedFactor> factors_;
  std::optional<ShapeFactor> factor_;  // none if the coarse mesh has all vertices
  Rotations rotations_;
};

}  // namespace dynmesh
