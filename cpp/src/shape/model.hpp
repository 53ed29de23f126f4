/// What frame 0 and the training frames tell of the shape of a surface.
#pragma once

#include <dynmesh/topology.hpp>
#include <dynmesh/types.hpp>
#include <memory>
#include <span>
#include <vector>

#include "base/training_frames.hpp"
#include "base/workers.hpp"
#include "linear/masked_factor.hpp"
#include "shape/detail_operator.hpp"
#include "shape/modes.hpp"
#include "shape/rotations.hpp"

namespace dynmesh {

struct ShapeModel {
  /// `mesh_topology` and `frame`, which is frame 0, must outlive this object. `training` are frames
  /// of a training sequence, or none. `epsilon` is that of the type in which positions are given.
  ShapeModel(const Topology& mesh_topology, std::span<const Triangle> faces, Field frame,
             const TrainingFrames& training, double epsilon, Workers& workers);

  const Topology& topology;
  Field first_frame;
  double mean_edge;
  DetailOperator k;
  std::shared_ptr<const FactorPlan> plan;  ///< N = K^T K, of which each solver factors a part
  Rounding rounding;
  Surroundings surroundings;
  std::vector<Vector3> first_shape;  ///< (k,) m_first
  bool is_trained;                   ///< although there may be no modes for this frame 0
  Modes modes;                       ///< of the training

  [[nodiscard]] std::size_t size() const { return first_frame.size(); }
  [[nodiscard]] const Clusters& clusters() const { return surroundings.clusters; }
};

}  // namespace dynmesh
