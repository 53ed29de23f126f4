#include "mesh/ties.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

#include "base/geometry.hpp"
#include "base/point_tree.hpp"

namespace dynmesh {
namespace {

/// Components are tied at so many vertices whose distance to others is the smallest or, so that
/// they can be spread, greater by at most this, in mean edges.
constexpr std::size_t ties_of_component = 8;
constexpr double tied_within = 1.5;

}  // namespace

std::vector<std::uint32_t> spread(const std::vector<std::uint32_t>& vertices, std::size_t n,
                                  Field x) {
  if (vertices.size() <= n) return vertices;
  std::vector<std::uint32_t> chosen;
  std::vector<double> nearest(vertices.size(), std::numeric_limits<double>::infinity());
  for (std::ptrdiff_t next = 0; chosen.size() < n;) {
    chosen.push_back(vertices[next]);
    for (std::size_t i = 0; i < vertices.size(); ++i) {
      nearest[i] = std::min(nearest[i], squared_norm(x[vertices[i]] - x[chosen.back()]));
    }
    next = std::ranges::max_element(nearest) - nearest.begin();
  }
  return chosen;
}

/// Two components differ in a bit of their numbers. So the nearest vertex of another component is
/// the nearest one over all bits of those whose component has the other value of the bit, which
/// takes two trees for each bit. In one tree of all vertices, a search from inside a large
/// component would visit all of that component first.
std::vector<Index> find_donors(Field frame, std::span<const Index> component) {
  constexpr double scale = 0x1p-200;  // with which squares of all accepted coordinates are in range
  std::vector<std::array<double, 3>> positions;
  for (const auto& x : frame) positions.push_back(array_of(scale * x));
  std::vector<Index> donors(frame.size(), -1);
  std::vector<double> squared_distances(frame.size(), std::numeric_limits<double>::infinity());
  const auto last = static_cast<std::uint32_t>(component.empty() ? 0 : std::ranges::max(component));
  for (std::uint32_t bit = 0; last >> bit > 0; ++bit) {
    std::array<std::vector<Index>, 2> sides;
    for (std::size_t v = 0; v < frame.size(); ++v) {
      sides[component[v] >> bit & 1].push_back(static_cast<Index>(v));
    }
    for (std::size_t side = 0; side < 2; ++side) {
      std::vector<std::array<double, 3>> points;
      for (const Index v : sides[side]) points.push_back(positions[v]);
      const PointTree<3> tree(std::move(points));
      for (const Index v : sides[1 - side]) {
        tree.search(positions[v], squared_distances[v], [&](std::uint32_t i, double squared) {
          donors[v] = sides[side][i];
          return squared_distances[v] = squared;
        });
      }
    }
  }
  return donors;
}

std::vector<Tie> find_ties(const Topology& topology, Field first_frame, double mean_edge,
                           double weight) {
  if (topology.report.components < 2) return {};
  const std::vector<Index> nearest = find_donors(first_frame, topology.component);
  std::vector<double> distances;  // (k,) of each vertex from the nearest one, in mean edges
  std::vector<std::vector<std::uint32_t>> vertices(topology.report.components);
  for (std::uint32_t v = 0; v < first_frame.size(); ++v) {
    const double squared = squared_norm(first_frame[v] - first_frame[nearest[v]]);
    distances.push_back(std::sqrt(squared) / mean_edge);
    vertices[at(topology.component[v])].push_back(v);
  }
  const auto distance = [&](std::uint32_t v) { return distances[v]; };
  std::vector<Tie> ties;
  for (auto& of_component : vertices) {
    std::ranges::stable_sort(of_component, {}, distance);
    const double reach = distances[of_component[0]] + tied_within;
    const auto beyond = std::ranges::upper_bound(of_component, reach, {}, distance);
    const auto near = static_cast<std::size_t>(beyond - of_component.begin());
    of_component.resize(std::min(of_component.size(), std::max(near, ties_of_component)));
    for (const std::uint32_t v : spread(of_component, ties_of_component, first_frame)) {
      const auto other = static_cast<std::uint32_t>(nearest[v]);
      const double falling = weight / (1 + distances[v] * distances[v]);
      ties.push_back({v, other, falling, first_frame[v] - first_frame[other]});
    }
  }
  return ties;
}

std::size_t most_tied_pairs(std::size_t components) {
  if (components < 2) return 0;
  return std::min(ties_of_component * components, components * (components - 1) / 2);
}

std::vector<Tie> find_walls(const Topology& topology, Field first_frame, Field normals,
                            double mean_edge, double thickness, double weight) {
  constexpr double opposite = -0.7;  // the largest cosine between the normals of both sides
  constexpr double behind = 0.35;    // the least cosine between a tie and the way through the wall
  const PointTree<3> tree(arrays_of(first_frame));
  std::vector<std::uint8_t> is_tied(first_frame.size());
  std::vector<Tie> ties;
  for (std::uint32_t v = 0; v < first_frame.size(); ++v) {
    const auto is_near_tied = [&](Index other) { return is_tied[at(other)] != 0; };
    if (std::ranges::any_of(topology.cells[v], is_near_tied)) continue;
    double squared_nearest = mean_edge * mean_edge;
    std::uint32_t nearest = v;
    tree.search(array_of(first_frame[v]), squared_nearest,
                [&](std::uint32_t other, double squared) {
                  const auto through = first_frame[other] - first_frame[v];
                  if (topology.component[other] == topology.component[v] &&
                      dot(normals[v], normals[other]) < opposite &&
                      dot(normals[v], through) < -behind * std::sqrt(squared) &&
                      -dot(normals[v], through) < thickness * mean_edge) {
                    squared_nearest = squared;
                    nearest = other;
                  }
                  return squared_nearest;
                });
    if (nearest == v) continue;
    is_tied[v] = 1;
    const double falling = weight / (1 + squared_nearest / (mean_edge * mean_edge));
    ties.push_back({v, nearest, falling, first_frame[v] - first_frame[nearest]});
  }
  return ties;
}

}  // namespace dynmesh
