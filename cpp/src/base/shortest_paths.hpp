/// Shortest paths in graphs.
#pragma once

#include <cstddef>
#include <functional>
#include <limits>
#include <queue>
#include <utility>
#include <vector>

namespace dynmesh {

/// The distance of what no path reaches.
constexpr double unreached = std::numeric_limits<double>::infinity();

/// The lengths of the shortest paths from `start` to the numbers below `n` (Dijkstra 1959).
/// `neighbours(v, visit)` calls `visit(other, length)` for all edges from v.
template <class Neighbours>
std::vector<double> shortest_paths(std::size_t n, std::size_t start, const Neighbours& neighbours) {
  using Reached = std::pair<double, std::size_t>;
  std::vector<double> distances(n, unreached);
  std::priority_queue<Reached, std::vector<Reached>, std::greater<>> next;
  distances[start] = 0;
  next.emplace(0.0, start);
  while (!next.empty()) {
    const double distance = next.top().first;
    const std::size_t v = next.top().second;
    next.pop();
    if (distance > distances[v]) continue;
    neighbours(v, [&](std::size_t other, double length) {
      if (!(distance + length < distances[other])) return;
      distances[other] = distance + length;
      next.emplace(distances[other], other);
    });
  }
  return distances;
}

}  // namespace dynmesh
