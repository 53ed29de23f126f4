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

/// Cells c_i: the one-ring of vertex i is `neighbours[offsets[i]]` to `neighbours[offsets[i + 1] -
/// 1]`, ascending, each neighbour once. Every edge stands in both of its cells.
struct Cells {
  std::vector<Index> offsets = {0};
  std::vector<Index> neighbours;

  [[nodiscard]] std::size_t size() const { return offsets.size() - 1; }
  std::span<const Index> operator[](Index vertex) const {
    const auto i = static_cast<std::size_t>(vertex);
    return {neighbours.data() + offsets[i], neighbours.data() + offsets[i + 1]};
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

/// A face that the half-edge mesh could not hold. Its edges count in the cells all the same.
struct RefusedFace {
  std::size_t index;   ///< row of `faces`
  Refusal kind;        ///< for programs: what is wrong
  std::string reason;  ///< for people: what is wrong, naming the vertices or the other face
};

struct TopologyReport {
  std::size_t components = 0;         ///< connected components; an isolated vertex is one
  std::size_t isolated_vertices = 0;  ///< vertices with an empty cell
  std::size_t boundary_edges = 0;     ///< edges with one face, among the faces not refused
  std::vector<RefusedFace> refused_faces;
};

struct Topology {
  Cells cells;
  std::vector<Index> component;  ///< of each vertex; numbered by their first vertex
  TopologyReport report;
};

/// Builds the cells of a mesh of `n_vertices` vertices. Vertices are never deleted, merged or
/// renumbered. Degenerate faces (a repeated vertex), duplicates (the same three vertices as an
/// earlier face, in any order) and faces that OpenMesh refuses (non-manifold edges or vertices,
/// flipped neighbours) are reported; every edge between two distinct vertices of any face counts.
///
/// Linear in vertices and faces, except that OpenMesh walks around a vertex to insert a face, so
/// one vertex with v faces costs v^2. Safe to call from several threads.
///
/// Throws std::invalid_argument for an index outside [0, n_vertices), or for more vertices or
/// half-edges than `Index` can count.
DYNMESH_EXPORT Topology build_topology(Faces faces, std::size_t n_vertices);

}  // namespace dynmesh
