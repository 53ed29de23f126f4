#include <algorithm>
#include <cmath>
#include <cstddef>
#include <functional>
#include <numeric>
#include <tuple>

#include "detail/rotations.hpp"
#include "support/geometry.hpp"

namespace dynmesh {
namespace {

/// Packs lists of equal keys: `add(visit)` calls `visit(key, value)` in the order of the values.
template <class Add>
Cells lists_by_key(std::size_t n_keys, const Add& add) {
  Cells lists;
  lists.offsets.assign(n_keys + 1, 0);
  add([&](Index key, Index) { ++lists.offsets[key + 1]; });
  for (std::size_t i = 0; i < n_keys; ++i) lists.offsets[i + 1] += lists.offsets[i];
  lists.neighbours.resize(at(lists.offsets[n_keys]));
  std::vector<Index> filled(lists.offsets.begin(), lists.offsets.end() - 1);
  add([&](Index key, Index value) { lists.neighbours[filled[key]++] = value; });
  return lists;
}

/// The order in which vertices may become centres. Distances are rounded, since the order of a sum
/// over all vertices affects the mean.
std::vector<Index> in_order(std::span<const Vector3<double>> positions) {
  constexpr double steps = 1 << 20;
  Vector3<double> mean;
  for (const auto& position : positions) mean = mean + position;
  mean = (1 / static_cast<double>(positions.size())) * mean;
  std::vector<double> distances(positions.size());
  double largest = 0;
  for (std::size_t v = 0; v < distances.size(); ++v) {
    distances[v] = std::sqrt(squared_norm(positions[v] - mean));
    largest = std::max(largest, distances[v]);
  }
  if (largest > 0) {
    for (double& distance : distances) distance = std::round(distance / largest * steps);
  }
  std::vector<Index> order(positions.size());
  std::iota(order.begin(), order.end(), Index{0});
  std::ranges::sort(order, std::less{}, [&](Index v) {
    const Vector3<double>& p = positions[v];
    return std::tuple(-distances[v], p.x, p.y, p.z, v);
  });
  return order;
}

}  // namespace

Clusters cluster_vertices(const Cells& cells, std::span<const Vector3<double>> positions) {
  const auto k = static_cast<Index>(cells.size());
  Clusters clusters;
  std::vector<Index> cell_of(at(k), none);
  const auto found = [&](Index centre) {
    clusters.centres.push_back(centre);
    return static_cast<Index>(clusters.centres.size()) - 1;
  };
  const std::vector<Index> order = in_order(positions);
  for (const Index v : order) {
    const auto is_taken = [&](Index j) { return cell_of[j] != none; };
    if (is_taken(v) || std::ranges::any_of(cells[v], is_taken)) continue;
    cell_of[v] = found(v);
    for (const Index j : cells[v]) cell_of[j] = cell_of[v];
  }
  clusters.of_vertex = cell_of;
  for (Index v = 0; v < k; ++v) {
    if (cell_of[v] != none) continue;
    // A neighbour is in a cell, otherwise this vertex would be a centre. Of several clusters, the
    // first one.
    Index first = static_cast<Index>(clusters.size());
    for (const Index j : cells[v]) {
      if (cell_of[j] != none) first = std::min(first, cell_of[j]);
    }
    clusters.of_vertex[v] = first;
  }
  clusters.members = lists_by_key(clusters.size(), [&](const auto& visit) {
    for (Index v = 0; v < k; ++v) visit(clusters.of_vertex[v], v);
  });
  std::vector<Index> last_visitor(clusters.size());
  clusters.neighbours = lists_by_key(clusters.size(), [&](const auto& visit) {
    std::ranges::fill(last_visitor, none);
    for (Index c = 0; c < static_cast<Index>(clusters.size()); ++c) {
      last_visitor[c] = c;
      for (const Index v : clusters.members[c]) {
        for (const Index j : cells[v]) {
          const Index other = clusters.of_vertex[j];
          if (last_visitor[other] == c) continue;
          last_visitor[other] = c;
          visit(c, other);
        }
      }
    }
  });
  return clusters;
}

}  // namespace dynmesh
