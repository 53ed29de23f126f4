#include "tracking/boundary_reach.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>

#include "support/geometry.hpp"

namespace dynmesh {

BoundaryReach::BoundaryReach(std::span<const Triangle> faces, const Topology& topology,
                             Field first_frame, std::span<const std::uint8_t> is_cloth,
                             Workers& workers, const TrackingConstants& constants)
    : topology_(topology),
      workers_(workers),
      constants_(constants),
      reaches_(topology.cells.size()) {
  std::map<std::size_t, std::vector<std::size_t>> along;
  for (const auto& edge : boundary_edges(faces)) {
    const auto a = static_cast<std::size_t>(edge[0]);
    const auto b = static_cast<std::size_t>(edge[1]);
    if (is_cloth[a] == 0) continue;
    along[a].push_back(b);
    along[b].push_back(a);
  }
  for (auto& [v, neighbours] : along) {
    const double length = std::sqrt(squared_norm(sum_of_edges(v, first_frame)));
    boundary_.push_back({v, std::move(neighbours), length});
  }
}

/// The sum of the edges to a vertex. At a boundary, it points outwards.
Vector3<double> BoundaryReach::sum_of_edges(std::size_t v, Field x) const {
  Vector3<double> sum;
  for (const Index n : topology_.cells[static_cast<Index>(v)]) {
    sum = sum + (x[v] - x[static_cast<std::size_t>(n)]);
  }
  return sum;
}

std::span<const Reach> BoundaryReach::find(const Surface& surface, const Measurement& measurement) {
  workers_.for_each_short_chunk(static_cast<Index>(boundary_.size()), [&](Index first, Index last) {
    for (auto i = static_cast<std::size_t>(first); i < static_cast<std::size_t>(last); ++i) {
      reaches_[boundary_[i].vertex] = reach_of(boundary_[i], surface, measurement);
    }
  });
  return reaches_;
}

/// A vertex of a boundary, and the measured surface along a line through it.
struct BoundaryReach::Rim {
  std::size_t vertex;
  Vector3<double> here, normal, outward;
  bool is_seen_from_both_sides;
  double mean_edge;
  const Measurement& measurement;
  const TrackingConstants& constants;

  /// The point nearest to so many mean edges ahead.
  [[nodiscard]] Correspondence point_at(double ahead, std::uint32_t guess,
                                        bool is_of_any_side) const {
    const auto there = here + (ahead * mean_edge) * outward;
    const double radius = constants.reach_radius * mean_edge;
    return is_of_any_side ? measurement.nearest_of_both_sides(there, normal, radius,
                                                              constants.agreement, guess)
                          : measurement.nearest(there, normal, radius, constants.agreement, guess);
  }
  /// The surface ends so many mean edges ahead.
  [[nodiscard]] Reach reach(double ahead) const {
    return {outward, here + (ahead * mean_edge) * outward};
  }
  /// The part of the way to a point that leads in one direction, in mean edges.
  [[nodiscard]] double way(const Correspondence& c, const Vector3<double>& direction) const {
    return dot(c.point - here, direction) / mean_edge;
  }
};

Reach BoundaryReach::reach_of(const BoundaryVertex& b, const Surface& surface,
                              const Measurement& measurement) const {
  const std::size_t v = b.vertex;
  if (surface.visible[v] == Sight::hidden) return {};
  const double h = surface.mean_edge;
  const auto& normal = surface.normals[v];
  auto sum = sum_of_edges(v, surface.x);
  sum = sum - dot(sum, normal) * normal;
  const double length = std::sqrt(squared_norm(sum));
  if (!(length > constants_.least_outward * h)) return {};
  // The sum leans to the side where edges are more; the boundary itself does not.
  auto outward = sum;
  if (b.along.size() == 2) {
    const auto conormal = cross(normal, surface.x[b.along[0]] - surface.x[b.along[1]]);
    if (squared_norm(conormal) > 0) outward = dot(conormal, sum) < 0 ? -1.0 * conormal : conormal;
  }
  outward = (1 / std::sqrt(squared_norm(outward))) * outward;
  const bool is_seen_from_both_sides = surface.visible[v] == Sight::both;
  const Rim rim = {v, surface.x[v], normal,    outward, is_seen_from_both_sides,
                   h, measurement,  constants_};
  if (const double end = extension(rim, surface); end > 0) {
    return rim.reach(end);
  }
  if (length < constants_.least_stretch * b.first_length) return {};
  if (const double beyond = overshoot(rim); beyond > 0) {
    return rim.reach(-beyond);
  }
  return {};
}

/// Follows the measured surface from the vertex outwards, in short steps. Returns how far it goes,
/// in mean edges; 0 if it ends at the vertex, if it does not end, or if it is that of another part.
double BoundaryReach::extension(const Rim& rim, const Surface& surface) const {
  double end = 0;
  std::uint32_t guess = Measurement::no_guess;
  for (double ahead = constants_.reach_step; ahead - end <= constants_.reach_gap;
       ahead += constants_.reach_step) {
    if (ahead > constants_.farthest_reach) return 0;
    const Correspondence c = rim.point_at(ahead, guess, rim.is_seen_from_both_sides);
    if (c.weight == 0) continue;
    guess = c.number;
    const double along = rim.way(c, rim.outward);
    if (!(along > end && std::abs(rim.way(c, rim.normal)) < constants_.reach_height)) continue;
    // A point that is nearer to another part of the surface says nothing about this one.
    const double radius = 2 * constants_.farthest_reach * rim.mean_edge;
    const auto& side = rim.is_seen_from_both_sides ? c.normal : rim.normal;
    const auto owner = surface.index.find(c.point, side, radius, constants_.agreement);
    const auto ring = topology_.cells[static_cast<Index>(rim.vertex)];
    const bool is_own =
        owner.any && (owner.index == rim.vertex ||
                      std::ranges::count(ring, static_cast<Index>(owner.index)) > 0);
    if (!is_own) return 0;
    end = along;
  }
  return end;
}

/// Follows the surface from the vertex inwards, until there is a measured point, of either side,
/// since that of the back of a rim shows as well that the surface is there. Returns how far the
/// vertex lies beyond it, in mean edges; 0 if it does not, or if no point is found.
double BoundaryReach::overshoot(const Rim& rim) const {
  for (double back = 0; back <= constants_.farthest_overshoot; back += constants_.reach_step) {
    const Correspondence c = rim.point_at(-back, Measurement::no_guess, true);
    if (c.weight == 0) continue;
    const double beyond = -rim.way(c, rim.outward);
    return beyond < constants_.least_overshoot ? 0 : beyond;
  }
  return 0;
}

}  // namespace dynmesh
