#include "surface_fit/boundary.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "base/geometry.hpp"

namespace dynmesh {

Boundary::Boundary(std::span<const Triangle> faces, const Topology& topology, double mean_edge,
                   std::span<const Material> materials, const TrackingConstants& constants)
    : topology_(topology),
      constants_(constants),
      mean_edge_(mean_edge),
      next_sides_(next_sides(faces)),
      materials_(materials),
      is_boundary_(topology.component.size()) {
  for (std::size_t side = 0; side < next_sides_.size(); ++side) {
    if (next_sides_[side] != side) continue;
    for (const std::size_t end : {side + 1, side + 2}) {
      is_boundary_[faces[side / 3][end % 3]] = 1;
    }
  }
}

/// Whether a place is on the boundary: a vertex or a side of it.
bool Boundary::contains(const Place& place) const {
  if (is_boundary_[place.nearest_corner()] == 0) return false;
  const auto n_zero = std::ranges::count(place.shares, 0.0);
  const auto zero = std::ranges::find(place.shares, 0.0) - place.shares.begin();
  const std::size_t side = 3 * place.face + static_cast<std::size_t>(zero);
  return n_zero == 2 || (n_zero == 1 && next_sides_[side] == side);
}

/// The unit direction in which the surface ends at a vertex of its boundary; 0 where it has none.
Vector3 Boundary::conormal(std::uint32_t vertex, Field x, Field normals) const {
  Vector3 sum;
  for (const Index other : topology_.cells[vertex]) {
    sum = sum + (1 / mean_edge_) * (x[vertex] - x[other]);
  }
  sum = sum - dot(sum, normals[vertex]) * normals[vertex];
  const double length = std::sqrt(squared_norm(sum));
  return length > 0 ? (1 / length) * sum : Vector3{};
}

void Boundary::draw(Field x, Field normals, std::vector<SurfaceRow>& rows) const {
  const std::size_t n = rows.size();
  std::vector<Vector3> conormals(x.size());
  for (std::uint32_t v = 0; v < x.size(); ++v) {
    if (is_boundary_[v] != 0) conormals[v] = conormal(v, x, normals);
  }
  const auto outwards = [&](const SurfaceRow& row) {
    const auto offset = row.point - row.on(x);
    return offset - dot(offset, row.normal) * row.normal;
  };
  // Of the points around a boundary vertex, along its conormal: the outermost place of one that is
  // not far, and how far points lie beyond it.
  std::vector<double> outermost(x.size(), -std::numeric_limits<double>::infinity());
  std::vector<double> beyond(x.size());
  for (std::size_t r = 0; r < n; ++r) {
    for (std::size_t s = 0; s < 3; ++s) {
      const auto v = rows[r].corners[s];
      if (is_boundary_[v] == 0) continue;
      const double along = dot(conormals[v], rows[r].on(x) - x[v]) / mean_edge_;
      if (rows[r].squared < mean_edge_ * mean_edge_) outermost[v] = std::max(outermost[v], along);
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
    // That of a body, which keeps no lengths, would follow single points.
    if (!materials_[topology_.component[v]].slides) continue;
    if (!(end > -constants_.farthest_end && end < -constants_.resolution)) continue;
    SurfaceRow row;
    row.corners = {v, v, v};
    row.normal = conormals[v];
    row.point = x[v] + mean_edge_ * (end + constants_.resolution) * conormals[v];
    row.weight = constants_.boundary_weight;
    rows.push_back(row);
  }
}

}  // namespace dynmesh
