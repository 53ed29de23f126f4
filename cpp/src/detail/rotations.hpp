/// The rotation of the surface around each vertex since frame 0.
#pragma once

#include <dynmesh/topology.hpp>
#include <dynmesh/types.hpp>
#include <span>
#include <vector>

#include "kernels/kernels.hpp"
#include "support/workers.hpp"

namespace dynmesh {

/// Q_i is the rotation that best maps the cell of vertex i in frame 0 to the current cell. The
/// edges are weighted by the inverse of their squared length in frame 0, and the covariance is
/// averaged once with those of the neighbours. Each fit starts from the previous one, so a vertex
/// whose cell does not determine a rotation keeps its rotation. Allocates memory only in the
/// constructor.
class Rotations {
 public:
  /// `cells` and `workers` must outlive this object.
  Rotations(const Cells& cells, Workers& workers,
            const RotationKernels& kernels = best_kernels().rotations);

  /// Sets frame 0, in any unit of length, and resets all rotations to the identity.
  void reset(std::span<const Vector3<double>> first_frame, double mean_edge);

  /// `averagings` is how often the covariances are averaged with those of the neighbours. More than
  /// one needs a call of `allow_averaging` before.
  void fit(std::span<const Vector3<double>> frame, int averagings = 1);
  /// Allocates what more than one averaging needs.
  void allow_averaging() { averaged_.resize(cells_.size()); }

  /// Multiplies each of three fields (3 k,), stored side by side, by Q, which rotates them from the
  /// axes of frame 0 to those of the fitted frame. The result is valid until the next call, and so
  /// is that of `turn_back`.
  std::span<const Vector3<double>> turn(std::span<const Vector3<double>> triples);
  /// Multiplies a field (k,) by Q^T.
  std::span<const Vector3<double>> turn_back(std::span<const Vector3<double>> field);
  /// The same for one field, into the caller's array, which must not be `field`.
  void turn(std::span<const Vector3<double>> field, std::span<Vector3<double>> turned) const;
  void turn_back(std::span<const Vector3<double>> field, std::span<Vector3<double>> turned) const;

  /// The rotations (k,), as unit quaternions.
  [[nodiscard]] std::span<Quaternion> quaternions() { return quaternions_; }
  [[nodiscard]] std::span<const Quaternion> quaternions() const { return quaternions_; }

 private:
  void average_covariances();

  const Cells& cells_;
  Workers& workers_;
  const RotationKernels& kernels_;
  const OperatorKernels& turning_;
  std::vector<Vector3<double>> rest_edges_;  // of each half-edge, divided by its squared length
  std::vector<Covariance> covariances_;
  std::vector<Covariance> averaged_;
  std::vector<Quaternion> quaternions_;
  std::vector<Vector3<double>> turned_;
};

}  // namespace dynmesh
