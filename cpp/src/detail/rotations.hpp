/// The rotation of the surface around each vertex since frame 0.
#pragma once

#include <dynmesh/topology.hpp>
#include <dynmesh/types.hpp>
#include <span>
#include <vector>

#include "detail/detail_operator.hpp"
#include "kernels/kernels.hpp"
#include "support/geometry.hpp"
#include "support/workers.hpp"

namespace dynmesh {

/// Each vertex is in one cluster. Most clusters are a cell whose vertices are in no other cluster.
struct Clusters {
  using Weights = Eigen::SparseMatrix<double, Eigen::RowMajor, Index>;
  static constexpr Index typical_size = 7;  ///< vertices

  std::vector<Index> of_vertex;  ///< (k,)
  std::vector<Index> centres;    ///< (clusters,) a vertex of each
  Cells members;     ///< the vertices of each cluster; `members[c]` instead of the cell of a vertex
  Cells neighbours;  ///< the clusters that an edge connects with each cluster
  Weights weights;   ///< (k, clusters) the share of a cell, with its vertex, that is in each one

  [[nodiscard]] std::size_t size() const { return centres.size(); }
};

/// Aggregates vertices as in algebraic multigrid (Vanek, Mandel and Brezina 1996): vertices become
/// centres if nobody in their cell has a cluster, and their cell becomes theirs; then what is left
/// joins a cluster of a neighbour. Vertices far from the mean position come first, and of vertices
/// at the same distance those with the smaller coordinates, so that the clusters do not depend on
/// the numbers of the vertices. Sorts the vertices; otherwise linear in the number of edges.
Clusters cluster_vertices(const Cells& cells, std::span<const Vector3<double>> positions);

/// x turned by a unit quaternion.
inline Vector3<double> rotated(const Quaternion& q, const Vector3<double>& x) {
  const Vector3<double> axis = {q.x, q.y, q.z};
  const auto twice = 2.0 * cross(axis, x);
  return x + q.w * twice + cross(axis, twice);
}

/// The rotation b, and then a.
inline Quaternion product(const Quaternion& a, const Quaternion& b) {
  return {
      a.w * b.w - a.x * b.x - a.y * b.y - a.z * b.z, a.w * b.x + a.x * b.w + a.y * b.z - a.z * b.y,
      a.w * b.y - a.x * b.z + a.y * b.w + a.z * b.x, a.w * b.z + a.x * b.y - a.y * b.x + a.z * b.w};
}

/// Refuses a state in which these are not all of unit length.
void check_stored(std::span<const Quaternion> rotations);

/// Q_i is the rotation that best maps the cell of vertex i in frame 0 to the current cell. The
/// edges are weighted by the inverse of their squared length in frame 0, and the covariances are
/// averaged over clusters of vertices, since those of single cells are disturbed by the errors of
/// single positions. Each fit starts from the previous one, so a vertex whose surroundings do not
/// determine a rotation keeps its rotation. Allocates memory only in the constructor.
class Rotations {
 public:
  using Field = std::span<const Vector3<double>>;

  /// `workers` must outlive this object. All rotations are the identity.
  Rotations(const Cells& cells, Workers& workers, std::span<const Vector3<double>> first_frame,
            double mean_edge);

  /// Adds up the covariances of each cluster and averages these sums twice with the neighbouring
  /// clusters. Each vertex then takes the mean rotation of the clusters of its cell.
  void fit(std::span<const Vector3<double>> frame);

  /// Turns further by rotations of the clusters: each vertex by the mean of those of its cell.
  void turn_further(std::span<const Quaternion> of_clusters);

  /// Multiplies a field (k,) by Q, which rotates it from the axes of frame 0 to those of the fitted
  /// frame. The result may be the same memory.
  void turn(Field field, std::span<Vector3<double>> turned) const { turn(false, field, 1, turned); }
  /// The same for three fields.
  void turn(std::span<const ShapeTerms> terms, std::span<ShapeTerms> turned) const {
    turn(false, side_by_side(terms), 3, side_by_side(turned));
  }
  /// Multiplies a field (k,) by Q^T. The result may be the same memory.
  void turn_back(Field field, std::span<Vector3<double>> turned) const {
    turn(true, field, 1, turned);
  }

  /// The rotations (k,), as unit quaternions.
  [[nodiscard]] std::span<Quaternion> quaternions() { return quaternions_; }
  [[nodiscard]] std::span<const Quaternion> quaternions() const { return quaternions_; }

  /// The clusters of frame 0.
  [[nodiscard]] const Clusters& clusters() const { return clusters_; }

 private:
  void blend(std::span<const Quaternion> of_clusters, std::span<Quaternion> of_vertices) const;
  void turn(bool back, Field field, int fields, std::span<Vector3<double>> turned) const;

  Workers& workers_;
  Clusters clusters_;
  Cells ends_;                               // the vertices of the cells of each cluster
  std::vector<Vector3<double>> rest_edges_;  // to these ends from its centre
  std::vector<Quaternion> quaternions_;
  std::vector<Covariance> sums_, averaged_;  // of the clusters
  std::vector<Quaternion> turns_;            // of the clusters
  std::vector<Quaternion> further_;          // (k,)
};

}  // namespace dynmesh
