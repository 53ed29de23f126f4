/// The rotation of the surface around each vertex since frame 0.
#pragma once

#include <Eigen/Geometry>
#include <dynmesh/topology.hpp>
#include <dynmesh/types.hpp>
#include <span>
#include <vector>

#include "base/geometry.hpp"
#include "base/workers.hpp"
#include "kernels/kernels.hpp"
#include "mesh/clusters.hpp"
#include "shape/detail_operator.hpp"

namespace dynmesh {

/// x turned by a unit quaternion.
inline Vector3 rotated(const Quaternion& q, const Vector3& x) {
  const Vector3 axis = {q.x, q.y, q.z};
  const auto twice = 2.0 * cross(axis, x);
  return x + q.w * twice + cross(axis, twice);
}

/// The rotation b, and then a.
inline Quaternion product(const Quaternion& a, const Quaternion& b) {
  return {
      a.w * b.w - a.x * b.x - a.y * b.y - a.z * b.z, a.w * b.x + a.x * b.w + a.y * b.z - a.z * b.y,
      a.w * b.y - a.x * b.z + a.y * b.w + a.z * b.x, a.w * b.z + a.x * b.y - a.y * b.x + a.z * b.w};
}

inline Quaternion quaternion_of(const Eigen::Matrix3d& rotation) {
  const Eigen::Quaterniond q(rotation);
  return {q.w(), q.x(), q.y(), q.z()};
}
inline Eigen::Matrix3d rotation_matrix(const Quaternion& q) {
  return Eigen::Quaterniond(q.w, q.x, q.y, q.z).toRotationMatrix();
}

/// Multiplies a field (k,) by Q, which rotates it from the axes of frame 0 to those of the fitted
/// frame. The result may be the same memory.
void turn(std::span<const Quaternion> q, Field field, std::span<Vector3> turned, Workers& workers);
/// Multiplies three fields (k,) by Q.
void turn(std::span<const Quaternion> q, std::span<const ShapeTerms> terms,
          std::span<ShapeTerms> turned, Workers& workers);
/// Multiplies a field (k,) by Q^T. The result may be the same memory.
void turn_back(std::span<const Quaternion> q, Field field, std::span<Vector3> turned,
               Workers& workers);

/// Each vertex and what is around it in frame 0.
struct Surroundings {
  Surroundings(const Cells& cells, Field first_frame, double mean_edge);

  Clusters clusters;
  Cells ends;                       ///< the vertices of the cells of each cluster
  std::vector<Vector3> rest_edges;  ///< to these ends from its centre
};

/// Q_i (docs/method.md, 8) best maps the cell of vertex i in frame 0 to the current cell. The
/// edges are weighted by the inverse of their squared length in frame 0, and the covariances are
/// averaged over clusters of vertices, since those of single cells are disturbed by the errors of
/// single positions. Each fit starts from the previous one, so a vertex whose surroundings do not
/// determine a rotation keeps its rotation. Allocates memory only in the constructor.
class Rotations {
 public:
  /// `surroundings` and `workers` must outlive this object.
  Rotations(const Surroundings& surroundings, Workers& workers);

  /// Adds up the covariances of each cluster and averages these sums twice with the neighbouring
  /// clusters. Each vertex then takes the mean rotation of the clusters of its cell. (k,) `q` are
  /// the rotations from which it starts, as unit quaternions, and those that it finds.
  void fit(Field frame, std::span<Quaternion> q);

  /// Turns `q` further by rotations of the clusters: each vertex by the mean of those of its cell.
  void turn_further(std::span<const Quaternion> of_clusters, std::span<const Quaternion> q,
                    std::span<Quaternion> turned);

 private:
  void blend(std::span<const Quaternion> of_clusters, std::span<Quaternion> of_vertices) const;

  const Surroundings& surroundings_;
  Workers& workers_;
  std::vector<Covariance> sums_, averaged_;  // of the clusters
  std::vector<Quaternion> turns_;            // of the clusters
};

}  // namespace dynmesh
