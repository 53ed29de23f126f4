#include "surface_fit/plane_anchors.hpp"

#include <cmath>
#include <cstdint>

#include "base/geometry.hpp"

namespace dynmesh {

PlaneAnchors::PlaneAnchors(std::span<const SurfaceRow> rows, Field x, const Topology& topology)
    : anchors(x.size(), true), normals(x.size()) {
  std::vector<std::uint8_t> is_drawn(topology.report.components);
  const auto component = [&](std::size_t v) { return at(topology.component[v]); };
  std::vector<double> along(x.size());
  for (const SurfaceRow& row : rows) {
    if (row.is_along) continue;  // it tells nothing of the distance from the surface
    is_drawn[component(row.corners[0])] = 1;
    const double distance = dot(row.normal, row.point - row.on(x));
    for (std::size_t s = 0; s < 3; ++s) {
      const auto v = row.corners[s];
      const double weight = row.weight * row.shares[s];
      anchors.weights[v] += weight;
      along[v] += weight * distance;
      normals[v] = normals[v] + weight * row.normal;
    }
  }
  for (std::size_t v = 0; v < x.size(); ++v) {
    const double length = std::sqrt(squared_norm(normals[v]));
    const bool is_seen = anchors.weights[v] > 0 && length > 0;
    normals[v] = is_seen ? (1 / length) * normals[v] : Vector3{};
    anchors.observed[v] = is_seen ? x[v] + (along[v] / anchors.weights[v]) * normals[v] : x[v];
    if (!is_seen) anchors.weights[v] = 0;
    anchors.is_solved[v] = is_drawn[component(v)];
    anchors.counts[v] = is_drawn[component(v)];
    anchors.number += is_seen ? 1 : 0;
    anchors.n_solved += is_drawn[component(v)];
  }
}

}  // namespace dynmesh
