/// A force that keeps the lengths of the edges of cloth.
#pragma once

#include <dynmesh/topology.hpp>
#include <dynmesh/types.hpp>
#include <span>
#include <vector>

#include "detail/detail_operator.hpp"
#include "detail/rotations.hpp"
#include "support/workers.hpp"
#include "tracking/constants.hpp"

namespace dynmesh {

/// The energy mu sum over edges of w_ij |(X_i - X_j) - (R_i e_ij - R_j e_ji) / 2|^2, where w_ij are
/// the cotangents of the operator of method detail, R rotates the cell of a vertex since frame 0,
/// and e_ij has the length of the edge in frame 0, and the direction of that of the last frame,
/// turned back to the axes of frame 0 (after as-rigid-as-possible, Sorkine and Alexa 2007). So
/// lengths come back and folds stay. Its matrix is mu C, which lies inside of K^T K.
///
/// Allocates memory only in the constructor.
class Membrane {
 public:
  using Field = std::span<const Vector3<double>>;

  /// `is_cloth` (k,) are the vertices that have it. `topology`, `workers` and `constants` must
  /// outlive this object; `k` is the operator of the first frame.
  Membrane(const DetailOperator& k, Field first_frame, double mean_edge,
           std::span<const std::uint8_t> is_cloth, const Topology& topology, Workers& workers,
           const TrackingConstants& constants);

  /// Adds half of the negative gradient at X. `rotations` (k,) are those of the shape, from which
  /// those of single cells are found.
  void add_forces(Field x, std::span<const Quaternion> rotations,
                  std::span<Vector3<double>> forces);

  /// Makes this the last frame, with these rotations of the shape.
  void remember(Field last, std::span<const Quaternion> rotations);

 private:
  struct Edge {
    std::size_t from, to;
    double weight;
    Vector3<double> first;   // in frame 0
    Vector3<double> wanted;  // e_ij
  };
  void fit(Field x, std::span<const Quaternion> rotations);

  const TrackingConstants& constants_;
  Rotations rotations_;
  std::vector<Edge> edges_;  // both directions of each edge
};

}  // namespace dynmesh
