#include "registration/tips.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <limits>
#include <queue>

#include "support/geometry.hpp"

namespace dynmesh {
namespace {

constexpr double unreached = std::numeric_limits<double>::infinity();

/// The neighbours of each point, and how far they are.
using Graph = std::vector<std::vector<std::pair<std::size_t, double>>>;

/// The lengths of the shortest paths (Dijkstra 1959).
std::vector<double> distances_from(const Graph& graph, std::size_t start) {
  using Entry = std::pair<double, std::size_t>;
  std::vector<double> distances(graph.size(), unreached);
  std::priority_queue<Entry, std::vector<Entry>, std::greater<>> next;
  distances[start] = 0;
  next.emplace(0, start);
  while (!next.empty()) {
    const auto [distance, point] = next.top();
    next.pop();
    if (distance > distances[point]) continue;
    for (const auto& [other, length] : graph[point]) {
      if (!(distance + length < distances[other])) continue;
      distances[other] = distance + length;
      next.emplace(distances[other], other);
    }
  }
  return distances;
}

/// The distances from a point of the largest connected part.
std::vector<double> distances_in_largest_part(const Graph& graph) {
  std::vector<double> best;
  std::size_t most = 0;
  std::vector<std::uint8_t> is_seen(graph.size());
  for (std::size_t start = 0; start < graph.size(); ++start) {
    if (is_seen[start] != 0) continue;
    auto distances = distances_from(graph, start);
    std::size_t n = 0;
    for (std::size_t i = 0; i < graph.size(); ++i) {
      if (distances[i] == unreached) continue;
      is_seen[i] = 1;
      ++n;
    }
    if (n <= most) continue;
    most = n;
    best = std::move(distances);
  }
  return best;
}

/// Farthest points first. The point from which the first one is sought does not count.
Tips tips_of(const Graph& graph, std::size_t n_tips) {
  Tips tips;
  if (graph.empty()) return tips;
  std::vector<double> nearest = distances_in_largest_part(graph);
  const auto is_nearer = [](double a, double b) {
    return (a == unreached ? 0 : a) < (b == unreached ? 0 : b);
  };
  while (tips.numbers.size() < n_tips) {
    const auto farthest = std::ranges::max_element(nearest, is_nearer);
    if (!(*farthest > 0) || *farthest == unreached) break;
    tips.numbers.push_back(static_cast<std::size_t>(farthest - nearest.begin()));
    tips.from.push_back(distances_from(graph, tips.numbers.back()));
    const auto& last = tips.from.back();
    for (std::size_t i = 0; i < graph.size(); ++i) {
      if (last[i] != unreached)
        nearest[i] = std::min(tips.from.size() == 1 ? unreached : nearest[i], last[i]);
    }
  }
  // Where points are more regular, ways along them are shorter.
  double longest = 0;
  for (const auto& from : tips.from) {
    for (const double d : from) longest = d == unreached ? longest : std::max(longest, d);
  }
  for (auto& from : tips.from) {
    for (double& distance : from) distance /= longest;
  }
  return tips;
}

}  // namespace

Tips tips_of(const PointScan& scan, std::size_t n_tips, const TipConstants& constants) {
  const std::size_t n = scan.size();
  const auto count = static_cast<std::size_t>(constants.neighbours) + 1;
  std::vector<std::vector<std::uint32_t>> near(n);
  const auto distance = [&](std::size_t i, std::size_t j) {
    return std::sqrt(squared_norm(scan.points[i] - scan.points[j]));
  };
  double spacing = 0;
  for (std::size_t i = 0; i < n; ++i) {
    near[i] = scan.nearest_to(i, count);
    if (near[i].size() > 1) spacing += distance(i, near[i][1]) / static_cast<double>(n);
  }
  Graph graph(n);
  for (std::size_t i = 0; i < n; ++i) {
    for (const std::size_t j : near[i]) {
      if (j == i || distance(i, j) > constants.reach * spacing) continue;
      const bool is_undecided = scan.is_undecided(i) || scan.is_undecided(j);
      const double cosine = dot(scan.normals[i], scan.normals[j]);
      if (!is_undecided && cosine < constants.least_cosine) continue;
      graph[i].emplace_back(j, distance(i, j));
      graph[j].emplace_back(i, distance(i, j));
    }
  }
  return tips_of(graph, n_tips);
}

std::vector<std::vector<std::size_t>> likely_pairs(const Tips& first, const Tips& second,
                                                   const TipConstants& constants) {
  using Pairing = std::pair<double, std::vector<std::size_t>>;
  std::array<std::vector<Pairing>, 2> found;  // by the number of tips without another
  std::vector<std::size_t> chosen;
  const auto most = static_cast<std::size_t>(constants.candidates);
  // Fills `chosen` to the end in every way, keeping the best ones.
  const std::function<void(double, std::size_t)> extend = [&](double cost, std::size_t n_without) {
    const std::size_t tip = chosen.size();
    if (tip == first.numbers.size()) {
      auto& list = found[n_without];
      const Pairing made = {cost, chosen};
      list.insert(std::ranges::upper_bound(list, made), made);
      if (list.size() > most) list.pop_back();
      return;
    }
    for (std::size_t other = 0; other < second.numbers.size(); ++other) {
      if (std::ranges::find(chosen, other) != chosen.end()) continue;
      double more = 0;
      for (std::size_t i = 0; i < tip; ++i) {
        if (chosen[i] == no_tip) continue;
        more += std::abs(first.from[tip][first.numbers[i]] -
                         second.from[other][second.numbers[chosen[i]]]);
      }
      chosen.push_back(other);
      extend(cost + more, n_without);
      chosen.pop_back();
    }
    if (n_without + 1 == found.size()) return;
    chosen.push_back(no_tip);
    extend(cost, n_without + 1);
    chosen.pop_back();
  };
  extend(0, 0);
  std::vector<std::vector<std::size_t>> pairs;
  for (auto& list : found) {
    for (auto& [cost, pairing] : list) pairs.push_back(std::move(pairing));
  }
  return pairs;
}

}  // namespace dynmesh
