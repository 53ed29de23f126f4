/// The order of the vertices in memory, which affects how fast a large mesh is processed.
#pragma once

#include <dynmesh/topology.hpp>
#include <dynmesh/types.hpp>
#include <memory>
#include <vector>

#include "mesh/triangle.hpp"

namespace dynmesh {

/// Maps the caller's vertex indices to the internal indices, by which vertices are ordered in
/// memory. Both arrays are empty if the two are the same.
struct Numbering {
  std::vector<Index> caller_indices;    ///< (k,) the caller's index of each internal index
  std::vector<Index> internal_indices;  ///< (k,) the internal index of each of the caller's indices

  [[nodiscard]] bool is_natural() const { return caller_indices.empty(); }
  [[nodiscard]] std::size_t internal_index(std::size_t caller) const {
    return is_natural() ? caller : static_cast<std::size_t>(internal_indices[caller]);
  }
  [[nodiscard]] std::size_t caller_index(std::size_t internal) const {
    return is_natural() ? internal : static_cast<std::size_t>(caller_indices[internal]);
  }
};

/// Keeps the caller's order if neighbours are close to each other in memory, or if the mesh is so
/// small that the order does not matter. Otherwise the order is breadth first from a vertex at the
/// rim (Cuthill and McKee 1969, without sorting by degree).
Numbering choose_numbering(const Cells& cells);

/// Returns the same mesh with internal vertex indices. Neighbours keep their order in each cell, so
/// sums are the same to the last bit.
Topology renumber(const Topology& topology, const Numbering& numbering);

/// Chooses the internal order of the vertices and returns the topology in that order.
std::unique_ptr<const Topology> in_internal_order(Topology topology, Numbering& numbering);

/// The faces with internal vertex indices.
std::vector<Triangle> faces_in_internal_order(Faces faces, const Numbering& numbering);

/// Reorders `values` from the caller's order to the internal order.
template <class T>
std::vector<T> to_internal_order(const Numbering& numbering, const std::vector<T>& values) {
  std::vector<T> stored(values.size());
  for (std::size_t i = 0; i < values.size(); ++i) stored[numbering.internal_index(i)] = values[i];
  return stored;
}

/// Reorders `stored` from the internal order to the caller's order.
template <class T>
std::vector<T> to_caller_order(const Numbering& numbering, const std::vector<T>& stored) {
  std::vector<T> values(stored.size());
  for (std::size_t i = 0; i < values.size(); ++i) values[i] = stored[numbering.internal_index(i)];
  return values;
}

}  // namespace dynmesh
