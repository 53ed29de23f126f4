#include "tracking/cloth_boundary.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "support/geometry.hpp"
#include "tracking/cloth.hpp"

namespace dynmesh {

ClothBoundary::ClothBoundary(std::span<const Triangle> faces, const Topology& topology,
                             double mean_edge, std::span<const std::uint8_t> is_cloth,
                             const TrackingConstants& constants)
    : topology_(topology),
      constants_(constants),
      mean_edge_(mean_edge),
      side_is_boundary_(3 * faces.size()),
      is_boundary_(is_cloth.size()) {
  const auto edges = boundary_edges(faces);
  for (std::size_t f = 0; f < faces.size(); ++f) {
    for (std::size_t s = 0; s < 3; ++s) {
      const auto [a, b] = std::minmax(faces[f][(s + 1) % 3], faces[f][(s + 2) % 3]);
      if (is_cloth[static_cast<std::size_t>(a)] == 0) continue;
      if (!std::ranges::binary_search(edges, std::array<Index, 2>{a, b})) continue;
      side_is_boundary_[3 * f + s] = 1;
      is_boundary_[static_cast<std::size_t>(a)] = is_boundary_[static_cast<std::size_t>(b)] = 1;
    }
  }
}

bool ClothBoundary::contains(const Place& place) const {
  const auto n_zero = std::ranges::count(place.shares, 0.0);
  if (n_zero == 2) return is_boundary_[place.nearest_corner()] != 0;
  const auto zero = std::ranges::find(place.shares, 0.0) - place.shares.begin();
  return n_zero == 1 && side_is_boundary_[3 * place.face + static_cast<std::size_t>(zero)] != 0;
}

/// The unit direction in which the cloth ends at a vertex of its boundary; 0 where it has none.
Vector3<double> ClothBoundary::conormal(std::uint32_t vertex, Field x, Field normals) const {
  Vector3<double> sum;
  for (const Index other : topology_.cells[static_cast<Index>(vertex)]) {
    sum = sum + (1 / mean_edge_) * (x[vertex] - x[static_cast<std::size_t>(other)]);
  }
  sum = sum - dot(sum, normals[vertex]) * normals[vertex];
  const double length = std::sqrt(squared_norm(sum));
  return length > 0 ? (1 / length) * sum : Vector3<double>{};
}

void ClothBoundary::draw(Field x, Field normals, std::vector<SurfaceRow>& rows) const {
  const std::size_t n = rows.size();
  std::vector<Vector3<double>> conormals(x.size());
  for (std::uint32_t v = 0; v < x.size(); ++v) {
    if (is_boundary_[v] != 0) conormals[v] = conormal(v, x, normals);
  }
  const auto outwards = [&](const SurfaceRow& row) {
    const auto offset = row.point - row.on(x);
    return offset - dot(offset, row.normal) * row.normal;
  };
  // Of the points around a boundary vertex, along its conormal: the outermost place, and how far
  // points lie beyond it.
  std::vector<double> outermost(x.size(), -std::numeric_limits<double>::infinity());
  std::vector<double> beyond(x.size());
  for (std::size_t r = 0; r < n; ++r) {
    for (std::size_t s = 0; s < 3; ++s) {
      const auto v = rows[r].corners[s];
      if (is_boundary_[v] == 0) continue;
      const double along = dot(conormals[v], rows[r].on(x) - x[v]) / mean_edge_;
      outermost[v] = std::max(outermost[v], along);
      if (!contains(rows[r]) || rows[r].shares[s] == 0) continue;
      beyond[v] = std::max(beyond[v], std::sqrt(squared_norm(outwards(rows[r]))) / mean_edge_);
    }
  }
  for (std::size_t r = 0; r < n; ++r) {
    if (!contains(rows[r])) continue;
    SurfaceRow row = rows[r];
    const auto direction = outwards(row);
    const double length = std::sqrt(squared_norm(direction));
    // Where the points go on farther, it is the template that ends, as at a cut limb.
    bool draws = length > 0;
    for (std::size_t s = 0; s < 3; ++s) {
      draws = draws && (row.shares[s] == 0 || beyond[row.corners[s]] < constants_.farthest_end);
    }
    if (!draws) continue;
    row.normal = (1 / length) * direction;
    row.weight *= constants_.boundary_weight;
    rows.push_back(row);
  }
  for (std::uint32_t v = 0; v < x.size(); ++v) {
    const double end = outermost[v];
    if (!(end > -constants_.farthest_overshoot && end < -constants_.least_overshoot)) continue;
    SurfaceRow row;
    row.corners = {v, v, v};
    row.normal = conormals[v];
    row.point = x[v] + mean_edge_ * (end + constants_.least_overshoot) * conormals[v];
    row.weight = constants_.boundary_weight;
    rows.push_back(row);
  }
}

}  // namespace dynmesh
