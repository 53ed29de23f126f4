/// The inner loops of fitting rotations, and of products with K and with rotations, optimised for
/// each kind of processor; see kernels.hpp.
///
/// Fields have one or three Vector3 for each vertex, side by side. Three fields together take much
/// less time than three separate ones, since the matrix is read only once.
#pragma once

#include <dynmesh/types.hpp>

namespace dynmesh {

struct Quaternion {
  double w;
  double x;
  double y;
  double z;
};

/// Returns the rotation R with the largest tr(R^T S), as a unit quaternion, for any S whose largest
/// entry is about 1. If several are equally good, returns `found` if it is one of them, and
/// otherwise the one nearest to `last`. Returns `last` if S is not finite.
Quaternion best_rotation(const double (&s)[3][3], const Quaternion& last, const Quaternion& found);

/// Row c is the sum, over a list, of coordinate c of the current edge times the rest edge.
struct Covariance {
  Vector3 rows[3];
};

/// Lists of weighted rest edges, of n vertices or clusters.
struct RotationData {
  const Index* offsets;
  const Index* ends;          // the vertices at the ends of the edges
  const Vector3* rest_edges;  // weighted
  const Index* starts;        // (n,) the vertices at which they start; null: 0 to n - 1
  const Vector3* frame;       // (k,)
  Covariance* covariances;    // (n,)
};

/// K = M^-1/2 C, see detail_operator.hpp, or C if `scale` is null.
struct OperatorData {
  const Index* offsets;
  const Index* columns;
  const double* values;
  const double* scale;
};

struct RotationKernels {
  /// Computes the covariances of the lists `first` to `last` - 1.
  void (*measure)(const RotationData& data, Index first, Index last);
  /// Adds up the covariances of the lists `first` to `last` - 1, and that with the number of the
  /// list.
  void (*add_lists)(const Covariance* from, const Index* offsets, const Index* members,
                    Covariance* sums, Index first, Index last);
  /// Fits the rotations `first` to `last` - 1 to their covariances. `fitted` holds the last fit and
  /// receives the new one.
  void (*fit)(const Covariance* covariances, Quaternion* fitted, Index first, Index last);
  /// Sets the rotations of the vertices `first` to `last` - 1 to the mean of those of the clusters,
  /// weighted by rows of `weights`. `cluster_of` has k numbers.
  void (*blend)(const OperatorData& weights, const Index* cluster_of, const Quaternion* of_clusters,
                Quaternion* rotations, Index first, Index last);
  /// Sets row n of `products` to row rows[n] of K x, or to row n if `rows` is null, for n = `first`
  /// to `last` - 1.
  void (*multiply)(const OperatorData& k, const Vector3* x, int fields, const Index* rows,
                   Vector3* products, Index first, Index last);
  /// Rotates rows `first` to `last` - 1 of one or three fields, by the inverse rotations if `back`.
  void (*turn)(const Quaternion* rotations, bool back, const Vector3* values, int fields,
               Vector3* turned, Index first, Index last);
};

}  // namespace dynmesh
