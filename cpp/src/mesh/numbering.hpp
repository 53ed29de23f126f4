/// The order of the vertices in memory, which decides how fast a large mesh is read.
#pragma once

#include <dynmesh/topology.hpp>
#include <dynmesh/types.hpp>
#include <vector>

namespace dynmesh {

/// Both empty where vertices lie as the caller numbers them.
struct Numbering {
  std::vector<Index> vertex_at;  ///< (k,) the caller's number of the vertex at each place
  std::vector<Index> place_of;   ///< (k,) the place of the caller's vertex of each number

  [[nodiscard]] bool is_natural() const { return vertex_at.empty(); }
  [[nodiscard]] std::size_t place(std::size_t vertex) const {
    return is_natural() ? vertex : static_cast<std::size_t>(place_of[vertex]);
  }
  [[nodiscard]] std::size_t vertex(std::size_t place) const {
    return is_natural() ? place : static_cast<std::size_t>(vertex_at[place]);
  }
};

/// The caller's numbering where neighbours lie near enough to each other, or the mesh is so small
/// that it does not matter; else breadth first from a vertex at the rim (Cuthill and McKee 1969,
/// without their order by degree).
Numbering choose_numbering(const Cells& cells);

/// The same mesh, its vertices numbered by their places. Neighbours keep their order in each cell,
/// so that sums come out the same to the last bit.
Topology renumber(const Topology& topology, const Numbering& numbering);

/// What the caller numbers `values` by vertices, put in their places.
template <class T>
std::vector<T> to_places(const Numbering& numbering, const std::vector<T>& values) {
  std::vector<T> placed(values.size());
  for (std::size_t i = 0; i < values.size(); ++i) placed[numbering.place(i)] = values[i];
  return placed;
}

/// The other way.
template <class T>
std::vector<T> to_vertices(const Numbering& numbering, const std::vector<T>& placed) {
  std::vector<T> values(placed.size());
  for (std::size_t i = 0; i < values.size(); ++i) values[i] = placed[numbering.place(i)];
  return values;
}

}  // namespace dynmesh
