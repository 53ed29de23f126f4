#include "shape/model.hpp"

#include "base/geometry.hpp"
#include "shape/shape_library.hpp"

namespace dynmesh {
namespace {

std::vector<Vector3> detail_of(Field frame, const DetailOperator& k, Workers& workers) {
  std::vector<Vector3> detail(frame.size());
  apply_operator(k, frame, 1, detail, workers);
  return detail;
}

}  // namespace

ShapeModel::ShapeModel(const Topology& mesh_topology, std::span<const Triangle> faces, Field frame,
                       const TrainingFrames& training, double epsilon, Workers& workers)
    : topology(mesh_topology),
      first_frame(frame),
      mean_edge(mean_edge_length(topology.cells, frame)),
      k(build_detail_operator(faces, topology.cells, frame)),
      plan(std::make_shared<const FactorPlan>(normal_matrix(k))),
      rounding(k, mean_edge, epsilon),
      surroundings(topology.cells, frame, mean_edge),
      first_shape(detail_of(frame, k, workers)),
      is_trained(!training.empty()),
      modes(training_modes(training, faces, *this, workers)) {}

}  // namespace dynmesh
