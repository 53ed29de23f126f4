/// The order of the vertices in memory, which decides how fast a large mesh is read.
#pragma once

#include <dynmesh/topology.hpp>
#include <dynmesh/types.hpp>
#include <vector>

namespace dynmesh {

/// Both empty where vertices lie as the caller numbers them.
struct Numbering {
  std::vector<Index> caller_indices;    ///< (k,) the caller's number of the vertex at each place
  std::vector<Index> internal_indices;  ///< (k,) the place of the caller's vertex of each number

  [[nodiscard]] bool is_natural() const { return caller_indices.empty(); }
  [[nodiscard]] std::size_t internal_index(std::size_t caller) const {
    return is_natural() ? caller : static_cast<std::size_t>(internal_indices[caller]);
  }
  [[nodiscard]] std::size_t caller_index(std::size_t internal) const {
    return is_natural() ? internal : static_cast<std::size_t>(caller_indices[internal]);
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
std::vector<T> to_internal_order(const Numbering& numbering, const std::vector<T>& values) {
  std::vector<T> stored(values.size());
  for (std::size_t i = 0; i < values.size(); ++i) stored[numbering.internal_index(i)] = values[i];
  return stored;
}

/// The other way.
template <class T>
std::vector<T> to_caller_order(const Numbering& numbering, const std::vector<T>& stored) {
  std::vector<T> values(stored.size());
  for (std::size_t i = 0; i < values.size(); ++i) values[i] = stored[numbering.internal_index(i)];
  return values;
}

}  // namespace dynmesh
