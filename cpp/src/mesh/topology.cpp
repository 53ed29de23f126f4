#include <OpenMesh/Core/Mesh/TriConnectivity.hh>
#include <algorithm>
#include <array>
#include <cstdint>
#include <dynmesh/topology.hpp>
#include <limits>
#include <optional>
#include <unordered_map>
#include <utility>

#include "base/checks.hpp"
#include "base/geometry.hpp"
#include "mesh/clusters.hpp"

namespace dynmesh {
namespace {

using Edge = std::pair<Index, Index>;

void check_indices(Faces faces, std::size_t n_vertices) {
  constexpr auto limit = static_cast<std::size_t>(std::numeric_limits<Index>::max());
  // Every face adds at most six entries to the cells: three edges, each in two cells.
  if (n_vertices >= limit || faces.count >= limit / 6) {
    refuse("faces", "a mesh of ", n_vertices, " vertices and ", faces.count,
           " faces is larger than 32-bit indices can count");
  }
  check_pointer("faces", faces.data, faces.count);
  for (std::size_t f = 0; f < faces.count; ++f) {
    for (const Index v : faces[f]) {
      if (v < 0 || static_cast<std::size_t>(v) >= n_vertices) {
        refuse("faces", "face ", f, " refers to vertex ", v, ", but the mesh has ", n_vertices,
               " vertices, counted from 0");
      }
    }
  }
}

struct Hash {
  std::size_t operator()(const Triangle& triangle) const {
    std::uint64_t hash = 0;
    for (const Index v : triangle) hash = (hash + at(v)) * 0x9e3779b97f4a7c15ULL;
    return static_cast<std::size_t>(hash ^ (hash >> 32U));
  }
};

RefusedFace unorderable(std::size_t f) {
  return {f, Refusal::non_manifold_vertex,
          "its vertices join fans of faces that cannot be ordered: non-manifold"};
}

/// Whether the two halfedges can be made consecutive, as a new face between them needs. Both are
/// boundary halfedges, and `before` ends where `after` begins. It is possible if the fan of faces
/// between them can be moved elsewhere around that vertex.
bool can_be_neighbours(const OpenMesh::TriConnectivity& mesh, OpenMesh::HalfedgeHandle before,
                       OpenMesh::HalfedgeHandle after) {
  if (mesh.next_halfedge_handle(before) == after) return true;
  auto gap = mesh.opposite_halfedge_handle(after);
  do gap = mesh.opposite_halfedge_handle(mesh.next_halfedge_handle(gap));
  while (!mesh.is_boundary(gap));
  return gap != before;
}

/// Why face f cannot be inserted into `mesh`; nothing where it can. OpenMesh finds the same out,
/// but then prints to a stream of the whole process that the host may be using, and gives no
/// reason.
std::optional<RefusedFace> refusal(const OpenMesh::TriConnectivity& mesh, std::size_t f,
                                   const Triangle& face) {
  std::array<OpenMesh::HalfedgeHandle, 3> halfedges;
  for (std::size_t corner = 0; corner < 3; ++corner) {
    const Index a = face[corner];
    const Index b = face[(corner + 1) % 3];
    const auto halfedge = mesh.find_halfedge(OpenMesh::VertexHandle(a), OpenMesh::VertexHandle(b));
    halfedges[corner] = halfedge;
    if (!halfedge.is_valid() || mesh.is_boundary(halfedge)) continue;
    const std::string edge = "edge (" + std::to_string(a) + ", " + std::to_string(b) + ")";
    if (mesh.is_boundary(mesh.opposite_halfedge_handle(halfedge))) {
      return RefusedFace{
          f, Refusal::flipped,
          edge + " runs the same way in a neighbouring face: one of the two is flipped"};
    }
    return RefusedFace{f, Refusal::non_manifold_edge,
                       edge + " already has two faces: non-manifold"};
  }
  for (const Index v : face) {
    if (!mesh.is_boundary(OpenMesh::VertexHandle(v))) {
      return RefusedFace{
          f, Refusal::non_manifold_vertex,
          "vertex " + std::to_string(v) + " is already enclosed by faces: non-manifold"};
    }
  }
  for (std::size_t corner = 0; corner < 3; ++corner) {
    const auto before = halfedges[corner];
    const auto after = halfedges[(corner + 1) % 3];
    if (!before.is_valid() || !after.is_valid()) continue;
    if (!can_be_neighbours(mesh, before, after)) return unorderable(f);
  }
  return std::nullopt;
}

/// Returns the edges of all faces, each at least once, and fills in the report about the faces.
std::vector<Edge> find_edges(Faces faces, std::size_t n_vertices, TopologyReport& report) {
  OpenMesh::TriConnectivity mesh;
  mesh.reserve(n_vertices, n_vertices + faces.count, faces.count);
  for (std::size_t v = 0; v < n_vertices; ++v) mesh.new_vertex();

  std::vector<Edge> edges;
  const auto refuse = [&](RefusedFace refused) {
    const auto face = faces[refused.index];
    report.refused_faces.push_back(std::move(refused));
    for (std::size_t corner = 0; corner < 3; ++corner) {
      const Index a = face[corner];
      const Index b = face[(corner + 1) % 3];
      if (a != b) edges.emplace_back(a, b);
    }
  };

  std::unordered_map<Triangle, std::size_t, Hash> first_with;  // the vertices, ascending
  first_with.reserve(faces.count);
  for (std::size_t f = 0; f < faces.count; ++f) {
    const auto face = faces[f];
    auto sorted = face;
    std::ranges::sort(sorted);
    if (face[0] == face[1] || face[1] == face[2] || face[2] == face[0]) {
      refuse({f, Refusal::degenerate,
              "degenerate: vertices " + std::to_string(face[0]) + ", " + std::to_string(face[1]) +
                  ", " + std::to_string(face[2]) + " are not distinct"});
    } else if (const auto [first, is_new] = first_with.try_emplace(sorted, f); !is_new) {
      refuse({f, Refusal::duplicate, "duplicate of face " + std::to_string(first->second)});
    } else if (std::optional<RefusedFace> refused = refusal(mesh, f, face)) {
      refuse(*std::move(refused));
    } else {
      const auto handle =
          mesh.add_face(OpenMesh::VertexHandle(face[0]), OpenMesh::VertexHandle(face[1]),
                        OpenMesh::VertexHandle(face[2]));
      if (!handle.is_valid()) refuse(unorderable(f));  // for a reason of later versions' own
    }
  }

  edges.reserve(edges.size() + mesh.n_edges());
  for (const auto edge : mesh.edges()) {
    edges.emplace_back(edge.v0().idx(), edge.v1().idx());
    report.boundary_edges += edge.is_boundary() ? 1U : 0U;
  }
  return edges;
}

Cells collect_cells(const std::vector<Edge>& edges, std::size_t n_vertices) {
  Cells cells = lists_by_key(n_vertices, [&](const auto& visit) {
    for (const auto& [a, b] : edges) {
      visit(a, b);
      visit(b, a);
    }
  });
  // Edges of refused faces may occur several times. Removing the duplicates moves the rows
  // together.
  const auto begin = cells.neighbours.begin();
  auto end = begin;
  auto first = begin;
  for (std::size_t v = 0; v < n_vertices; ++v) {
    const auto last = begin + cells.offsets[v + 1];
    std::sort(first, last);
    end = std::unique_copy(first, last, end);
    cells.offsets[v + 1] = static_cast<Index>(end - begin);
    first = last;
  }
  cells.neighbours.erase(end, cells.neighbours.end());
  cells.neighbours.shrink_to_fit();
  return cells;
}

}  // namespace

Topology build_topology(Faces faces, std::size_t n_vertices) {
  check_indices(faces, n_vertices);
  Topology topology;
  const std::vector<Edge> edges = find_edges(faces, n_vertices, topology.report);
  topology.cells = collect_cells(edges, n_vertices);
  const Cells components = find_components(topology.cells);
  topology.report.components = components.size();
  topology.component.resize(n_vertices);
  for (std::size_t c = 0; c < components.size(); ++c) {
    for (const Index v : components[c]) topology.component[at(v)] = static_cast<Index>(c);
  }
  for (std::size_t v = 0; v < n_vertices; ++v) {
    topology.report.isolated_vertices += topology.cells[v].empty() ? 1U : 0U;
  }
  return topology;
}

}  // namespace dynmesh
