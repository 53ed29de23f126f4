/// How the surface around each vertex has turned since frame 0.
#pragma once

#include <dynmesh/topology.hpp>
#include <dynmesh/types.hpp>
#include <span>
#include <vector>

#include "kernels/kernels.hpp"
#include "support/workers.hpp"

namespace dynmesh {

/// Q_i: the rotation that best carries the cell of vertex i in frame 0 to the current one: its
/// edges weighted by one over their squared length in frame 0, the covariance averaged once with
/// those of the neighbours. Each fit starts from the last one, so that a vertex whose cell does not
/// tell keeps its rotation. Allocates in the constructor only.
class Rotations {
 public:
  /// `cells` and `workers` must outlive this object.
  Rotations(const Cells& cells, Workers& workers,
            const RotationKernels& kernels = best_kernels().rotations);

  /// Frame 0, in any unit of length; no vertex has turned.
  void reset(std::span<const Vector3<double>> first_frame, double mean_edge);

  void fit(std::span<const Vector3<double>> frame);

  /// Q times each of three fields (3 k,), side by side, from the axes of frame 0 to those of the
  /// frame fitted to. Valid until the next call, as is what `turn_back` returns.
  std::span<const Vector3<double>> turn(std::span<const Vector3<double>> triples);
  /// Q^T times a field (k,).
  std::span<const Vector3<double>> turn_back(std::span<const Vector3<double>> field);

  /// (k,), of unit length.
  [[nodiscard]] std::span<Quaternion> quaternions() { return quaternions_; }
  [[nodiscard]] std::span<const Quaternion> quaternions() const { return quaternions_; }

 private:
  const Cells& cells_;
  Workers& workers_;
  const RotationKernels& kernels_;
  const OperatorKernels& turning_;
  std::vector<Vector3<double>> rest_edges_;  // of each half-edge, over its squared length
  std::vector<Covariance> covariances_;
  std::vector<Quaternion> quaternions_;
  std::vector<Vector3<double>> turned_;
};

}  // namespace dynmesh
