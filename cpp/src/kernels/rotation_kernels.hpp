/// The inner loops of fitting rotations, as fast as the processor allows; see dense_kernels.hpp.
#pragma once

#include <dynmesh/types.hpp>

namespace dynmesh {

struct Quaternion {
  double w;
  double x;
  double y;
  double z;
};

/// Row c is the sum over the cell of coordinate c of the current edge times the rest edge.
struct Covariance {
  Vector3<double> rows[3];
};

struct RotationData {
  const Index* cell_offsets;
  const Index* neighbours;
  const Vector3<double>* rest_edges;  // (half-edges,) weighted
  const Vector3<double>* frame;       // (k,)
  Covariance* covariances;            // (k,)
  Quaternion* quaternions;            // (k,) the last fit, and then this one
};

struct RotationKernels {
  /// The covariances of the vertices `first` to `last` - 1.
  void (*measure)(const RotationData& data, Index first, Index last);
  /// Their rotations, from the covariances of all.
  void (*turn)(const RotationData& data, Index first, Index last);
};

}  // namespace dynmesh
