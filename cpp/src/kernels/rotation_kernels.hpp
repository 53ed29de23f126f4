/// The inner loops of fitting rotations, optimised for each kind of processor; see
/// dense_kernels.hpp.
#pragma once

#include <dynmesh/types.hpp>

namespace dynmesh {

struct Quaternion {
  double w;
  double x;
  double y;
  double z;
};

/// Row c is the sum, over the cell, of coordinate c of the current edge times the rest edge.
struct Covariance {
  Vector3<double> rows[3];
};

struct RotationData {
  const Index* cell_offsets;
  const Index* neighbours;
  const Vector3<double>* rest_edges;  // (half-edges,) weighted
  const Vector3<double>* frame;       // (k,)
  Covariance* covariances;            // (k,)
  Quaternion* quaternions;            // (k,)
};

struct RotationKernels {
  /// Computes the covariances of the vertices `first` to `last` - 1.
  void (*measure)(const RotationData& data, Index first, Index last);
  /// Adds up the covariances of the lists `first` to `last` - 1, and that with the number of the
  /// list if `with_own`.
  void (*add_lists)(const Covariance* from, const Index* offsets, const Index* members,
                    bool with_own, Covariance* sums, Index first, Index last);
  /// Fits the rotations `first` to `last` - 1 to their covariances. `fitted` holds the last fit and
  /// receives the new one.
  void (*turn)(const Covariance* covariances, Quaternion* fitted, Index first, Index last);
  /// Sets the rotations of these vertices to the mean of those of the clusters of their cell, the
  /// vertex included. `cluster_of` has k numbers.
  void (*blend)(const RotationData& data, const Index* cluster_of, const Quaternion* of_clusters,
                Index first, Index last);
};

}  // namespace dynmesh
