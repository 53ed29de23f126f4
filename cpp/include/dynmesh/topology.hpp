/// The fixed connectivity of a dynamic mesh: which vertices share an edge (paper, section 3,
/// "Adjacency and Laplacian Matrix" and "Spatial Classification").
#pragma once

#include <cstddef>
#include <dynmesh/export.hpp>
#include <dynmesh/types.hpp>
#include <span>
#include <string>
#include <vector>

namespace dynmesh {

/// The cells c_i. The one-ring of vertex i is `neighbours[offsets[i]]` to `neighbours[offsets[i +
/// 1] - 1]`, in ascending order and without duplicates. Every edge is contained in the cells of
/// both of its vertices.
struct Cells {
  std::vector<Index> offsets = {0};
  std::vector<Index> neighbours;

  [[nodiscard]] std::size_t size() const { return offsets.size() - 1; }
  std::span<const Index> operator[](std::size_t vertex) const {
    return {neighbours.data() + offsets[vertex], neighbours.data() + offsets[vertex + 1]};
  }
};

/// Why the half-edge mesh could not hold a face.
enum class Refusal {
  degenerate,           ///< a vertex is repeated
  duplicate,            ///< an earlier face has the same three vertices
  flipped,              ///< a neighbouring face runs along the shared edge in the same direction
  non_manifold_edge,    ///< an edge already has two faces
  non_manifold_vertex,  ///< the faces around a vertex would not form a single fan
};

/// A face that the half-edge mesh cannot represent. Its edges still count in the cells.
struct RefusedFace {
  std::size_t index;   ///< the row in `faces`
  Refusal kind;        ///< for programs: what is wrong
  std::string reason;  ///< what is wrong, with the indices of the vertices or of the other face
};

struct TopologyReport {
  std::size_t components = 0;         ///< connected components, including isolated vertices
  std::size_t isolated_vertices = 0;  ///< vertices with an empty cell
  std::size_t boundary_edges = 0;     ///< edges with one face, among the faces not refused
  std::vector<RefusedFace> refused_faces;
};

struct Topology {
  Cells cells;
  std::vector<Index> component;  ///< the component of each vertex; components are numbered in the
                                 ///< order of their first vertices
  TopologyReport report;
};

/// Builds the cells of a mesh of `n_vertices` vertices. Vertices are never deleted, merged or
/// renumbered. The following faces are reported: degenerate ones, in which a vertex is repeated;
/// duplicates, which have the same three vertices as an earlier face in any order; and those that
/// OpenMesh refuses because of non-manifold edges or vertices or because a neighbour is flipped.
/// All edges between two distinct vertices of any face count.
///
/// The time is linear in the number of vertices and faces, except that OpenMesh iterates around a
/// vertex to insert a face, so one vertex with v faces takes time proportional to v^2. This
/// function may be called from several threads at once.
///
/// Throws std::invalid_argument for an index outside [0, n_vertices), and if there are more
/// vertices or half-edges than `Index` can count.
DYNMESH_EXPORT Topology build_topology(Faces faces, std::size_t n_vertices);

}  // namespace dynmesh
