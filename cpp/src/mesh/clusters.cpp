#include "mesh/clusters.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <functional>
#include <numeric>
#include <tuple>

#include "base/geometry.hpp"

namespace dynmesh {
Cells find_components(const Cells& cells) {
  Cells components;
  std::vector<Index>& members = components.neighbours;
  std::vector<std::uint8_t> is_reached(cells.size());
  const auto reach = [&](Index v) {
    if (is_reached[at(v)] == 0) members.push_back(v);
    is_reached[at(v)] = 1;
  };
  for (Index seed = 0; seed < static_cast<Index>(cells.size()); ++seed) {
    if (is_reached[at(seed)] != 0) continue;
    const std::size_t first = members.size();
    reach(seed);
    for (std::size_t next = first; next < members.size(); ++next) {
      std::ranges::for_each(cells[at(members[next])], reach);
    }
    std::ranges::sort(std::span(members).subspan(first));
    components.offsets.push_back(static_cast<Index>(members.size()));
  }
  return components;
}

std::vector<Index> in_order(const Cells& cells, Field positions) {
  constexpr double steps = 1 << 20;
  std::vector<double> distances(positions.size());
  const Cells components = find_components(cells);
  for (std::size_t c = 0; c < components.size(); ++c) {
    const auto members = components[c];
    Vector3 sum;
    for (const Index v : members) sum = sum + positions[v];
    const auto mean = (1 / static_cast<double>(members.size())) * sum;
    double largest = 0;
    for (const Index v : members) {
      distances[v] = std::sqrt(squared_norm(positions[v] - mean));
      largest = std::max(largest, distances[v]);
    }
    if (!(largest > 0)) continue;
    for (const Index v : members) distances[v] = std::round(distances[v] / largest * steps);
  }
  std::vector<Index> order(positions.size());
  std::iota(order.begin(), order.end(), Index{0});
  std::ranges::sort(order, std::less{}, [&](Index v) {
    const Vector3& p = positions[v];
    return std::tuple(-distances[v], p.x, p.y, p.z, v);
  });
  return order;
}

Clusters cluster_vertices(const Cells& cells, Field positions) {
  const auto k = static_cast<Index>(cells.size());
  Clusters clusters;
  std::vector<Index> cell_of(at(k), none);
  const std::vector<Index> order = in_order(cells, positions);
  for (const Index v : order) {
    const auto is_taken = [&](Index j) { return cell_of[j] != none; };
    if (is_taken(v) || std::ranges::any_of(cells[v], is_taken)) continue;
    cell_of[v] = static_cast<Index>(clusters.size());
    clusters.centres.push_back(v);
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
  std::vector<Eigen::Triplet<double, Index>> weights;
  for (Index v = 0; v < k; ++v) {
    const double share = 1 / static_cast<double>(cells[v].size() + 1);
    weights.emplace_back(v, clusters.of_vertex[v], share);
    for (const Index j : cells[v]) weights.emplace_back(v, clusters.of_vertex[j], share);
  }
  clusters.weights.resize(k, static_cast<Index>(clusters.size()));
  clusters.weights.setFromTriplets(weights.begin(), weights.end());
  return clusters;
}

}  // namespace dynmesh
