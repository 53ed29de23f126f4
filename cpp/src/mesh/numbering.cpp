#include "mesh/numbering.hpp"

#include <algorithm>
#include <array>
#include <cstdint>
#include <numeric>
#include <utility>

namespace dynmesh {
namespace {

/// Smaller meshes fit into the second-level cache in any order.
constexpr std::size_t small_mesh = 30'000;

/// The mean number of cache lines of 64 bytes that are fetched per vertex when every cell is read
/// in turn, with four vertices to a line and a cache of 2048 lines.
double lines_per_vertex(const Cells& cells) {
  std::array<Index, 2048> cached{};
  cached.fill(-1);
  std::size_t fetched = 0;
  for (const Index neighbour : cells.neighbours) {
    const Index line = neighbour / 4;
    Index& slot = cached[static_cast<std::size_t>(line) % cached.size()];
    if (slot != line) ++fetched;
    slot = line;
  }
  return static_cast<double>(fetched) / static_cast<double>(cells.size());
}

/// Appends the component of `start` to `order`, breadth first.
void search(const Cells& cells, Index start, std::vector<std::uint8_t>& found,
            std::vector<Index>& order) {
  std::size_t next = order.size();
  order.push_back(start);
  found[start] = 1;
  for (; next < order.size(); ++next) {
    for (const Index n : cells[order[next]]) {
      if (found[n] != 0) continue;
      found[n] = 1;
      order.push_back(n);
    }
  }
}

}  // namespace

Numbering choose_numbering(const Cells& cells) {
  // The minimum is one line for four vertices; a good numbering needs less than one line per
  // vertex.
  if (cells.size() < small_mesh || lines_per_vertex(cells) < 1.5) return {};
  Numbering numbering;
  auto& order = numbering.caller_indices;
  order.reserve(cells.size());
  std::vector<std::uint8_t> found(cells.size(), 0);
  for (std::size_t v = 0; v < cells.size(); ++v) {
    if (found[v] != 0) continue;
    // A vertex found last lies on the rim. A search from there has shorter fronts.
    const std::size_t first = order.size();
    search(cells, static_cast<Index>(v), found, order);
    const Index rim = order.back();
    for (std::size_t i = first; i < order.size(); ++i) found[order[i]] = 0;
    order.resize(first);
    search(cells, rim, found, order);
  }
  numbering.internal_indices.resize(cells.size());
  for (std::size_t internal = 0; internal < order.size(); ++internal) {
    numbering.internal_indices[order[internal]] = static_cast<Index>(internal);
  }
  return numbering;
}

Topology renumber(const Topology& topology, const Numbering& numbering) {
  Topology renumbered;
  renumbered.report = topology.report;
  Cells& cells = renumbered.cells;
  cells.offsets.reserve(topology.cells.offsets.size());
  cells.neighbours.reserve(topology.cells.neighbours.size());
  renumbered.component.reserve(topology.component.size());
  for (const Index vertex : numbering.caller_indices) {
    for (const Index n : topology.cells[vertex]) {
      cells.neighbours.push_back(numbering.internal_indices[n]);
    }
    cells.offsets.push_back(static_cast<Index>(cells.neighbours.size()));
    renumbered.component.push_back(topology.component[vertex]);
  }
  return renumbered;
}

std::unique_ptr<const Topology> in_internal_order(Topology topology, Numbering& numbering) {
  numbering = choose_numbering(topology.cells);
  return std::make_unique<const Topology>(numbering.is_natural() ? std::move(topology)
                                                                 : renumber(topology, numbering));
}

std::vector<Triangle> faces_in_internal_order(Faces faces, const Numbering& numbering) {
  std::vector<Triangle> renumbered(faces.count);
  for (std::size_t f = 0; f < faces.count; ++f) {
    std::ranges::transform(faces[f], renumbered[f].begin(), [&](Index v) {
      return static_cast<Index>(numbering.internal_index(static_cast<std::size_t>(v)));
    });
  }
  return renumbered;
}

}  // namespace dynmesh
