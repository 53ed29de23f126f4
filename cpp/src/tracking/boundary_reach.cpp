#include "tracking/boundary_reach.hpp"

#include <algorithm>
#include <cmath>

#include "support/geometry.hpp"

namespace dynmesh {

BoundaryReach::BoundaryReach(std::span<const Triangle> faces, const Topology& topology,
                             std::span<const std::uint8_t> is_cloth, Workers& workers,
                             const TrackingConstants& constants)
    : topology_(topology),
      workers_(workers),
      constants_(constants),
      reaches_(topology.cells.size()) {
  for (const auto& edge : boundary_edges(faces)) {
    for (const Index v : edge) {
      if (is_cloth[static_cast<std::size_t>(v)] != 0) vertices_.push_back(v);
    }
  }
  std::ranges::sort(vertices_);
  // Not by ranges, which Clang 14 refuses here.
  vertices_.erase(std::unique(vertices_.begin(), vertices_.end()), vertices_.end());
}

std::span<const Reach> BoundaryReach::find(const Surface& surface, const Measurement& measurement) {
  workers_.for_each_short_chunk(static_cast<Index>(vertices_.size()), [&](Index first, Index last) {
    for (Index i = first; i < last; ++i) {
      const auto v = static_cast<std::size_t>(vertices_[static_cast<std::size_t>(i)]);
      reaches_[v] = reach_of(v, surface, measurement);
    }
  });
  return reaches_;
}

/// Follows the measured surface from the vertex outwards, in short steps.
Reach BoundaryReach::reach_of(std::size_t v, const Surface& surface,
                              const Measurement& measurement) const {
  if (surface.visible[v] == Sight::hidden) return {};
  const double h = surface.mean_edge;
  const auto& here = surface.x[v];
  const auto& normal = surface.normals[v];
  const bool is_seen_from_both_sides = surface.visible[v] == Sight::both;
  const auto ring = topology_.cells[static_cast<Index>(v)];
  Vector3<double> sum;
  for (const Index n : ring) sum = sum + (here - surface.x[static_cast<std::size_t>(n)]);
  sum = sum - dot(sum, normal) * normal;
  const double length = std::sqrt(squared_norm(sum));
  if (!(length > constants_.least_outward * h)) return {};
  const auto outward = (1 / length) * sum;
  double end = 0;
  std::uint32_t guess = Measurement::no_guess;
  for (double ahead = constants_.reach_step; ahead - end <= constants_.reach_gap;
       ahead += constants_.reach_step) {
    if (ahead > constants_.farthest_reach) return {};
    const auto there = here + (ahead * h) * outward;
    const double radius = constants_.reach_radius * h;
    const Correspondence c =
        is_seen_from_both_sides
            ? measurement.nearest_of_both_sides(there, normal, radius, constants_.agreement, guess)
            : measurement.nearest(there, normal, radius, constants_.agreement, guess);
    if (c.weight == 0) continue;
    guess = c.number;
    const auto offset = (1 / h) * (c.point - here);
    const double along = dot(offset, outward);
    const double height = dot(offset, normal);
    if (!(along > end && std::abs(height) < constants_.reach_height)) continue;
    // A point that is nearer to another part of the surface says nothing about this one.
    const double reach = 2 * constants_.farthest_reach * h;
    const auto& side = is_seen_from_both_sides ? c.normal : normal;
    const auto owner = surface.index.find(c.point, side, reach, constants_.agreement);
    const bool is_own =
        owner.any &&
        (owner.index == v || std::ranges::count(ring, static_cast<Index>(owner.index)) > 0);
    if (!is_own) return {};
    end = along;
  }
  if (end < constants_.least_reach) return {};
  return {outward, (end - constants_.reach_margin) * h};
}

}  // namespace dynmesh
