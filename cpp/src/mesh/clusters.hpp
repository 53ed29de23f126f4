/// Clusters of neighbouring vertices.
#pragma once

#include <Eigen/SparseCore>
#include <cstddef>
#include <dynmesh/topology.hpp>
#include <dynmesh/types.hpp>
#include <vector>

namespace dynmesh {

/// Each vertex is in one cluster. Most clusters are a cell whose vertices are in no other cluster.
struct Clusters {
  using Weights = Eigen::SparseMatrix<double, Eigen::RowMajor, Index>;
  static constexpr Index typical_size = 8;  ///< vertices

  std::vector<Index> of_vertex;  ///< (k,)
  std::vector<Index> centres;    ///< (clusters,) a vertex of each
  Cells members;     ///< the vertices of each cluster; `members[c]` instead of the cell of a vertex
  Cells neighbours;  ///< the clusters that an edge connects with each cluster
  Weights weights;   ///< (k, clusters) the share of a cell, with its vertex, that is in each one

  [[nodiscard]] std::size_t size() const { return centres.size(); }
};

/// The vertices of each component, in order. The components have the order of their first vertices.
Cells find_components(const Cells& cells);

/// The order in which vertices may become centres, which does not depend on their numbers.
/// Distances from the mean are rounded, since the order of a sum over all vertices affects it.
std::vector<Index> in_order(const Cells& cells, Field positions);

/// Aggregates vertices as in algebraic multigrid (Vanek, Mandel and Brezina 1996): vertices become
/// centres if nobody in their cell has a cluster, and their cell becomes theirs; then what is left
/// joins a cluster of a neighbour. Vertices far from the mean position of their component come
/// first, and of vertices at the same distance those with the smaller coordinates, so that the
/// clusters depend neither on the numbers of the vertices nor on other components. Sorts the
/// vertices; otherwise linear in the number of edges.
Clusters cluster_vertices(const Cells& cells, Field positions);

}  // namespace dynmesh
