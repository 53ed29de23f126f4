#include "registration/coverage.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <vector>

#include "support/geometry.hpp"
#include "support/indices.hpp"
#include "tracking/robust_size.hpp"

namespace dynmesh {
namespace {

/// The mean distance between points that are spread over what the sensors should see.
double spacing_of(const SeenSurface& surface, std::size_t n_points) {
  double area = 0;
  for (const Triangle& face : surface.faces) {
    const auto corner = [&](std::size_t c) { return surface.x[at(face[c])]; };
    const double third =
        std::sqrt(squared_norm(cross(corner(1) - corner(0), corner(2) - corner(0)))) / 6;
    for (const Index v : face) {
      if (surface.seen[at(v)] != Sight::hidden) area += third;
    }
  }
  return std::sqrt(area / static_cast<double>(n_points));
}

/// (k,) which vertices the sensors should see, but have no point within a radius.
std::vector<std::uint8_t> find_empty(const SeenSurface& surface, const Measurement& scan,
                                     double radius, double agreement) {
  std::vector<std::uint8_t> empty(surface.x.size());
  for (std::size_t v = 0; v < empty.size(); ++v) {
    if (surface.seen[v] == Sight::hidden) continue;
    const auto nearest =
        scan.nearest(surface.x[v], surface.normals[v], radius, agreement, Measurement::no_guess);
    empty[v] = nearest.weight == 0 ? 1 : 0;
  }
  return empty;
}

double share_bridging(const SeenSurface& surface, std::span<const std::uint8_t> empty,
                      double largest_stretch) {
  double n_edges = 0;
  double n_bridging = 0;
  for (std::size_t v = 0; v < surface.x.size(); ++v) {
    for (const Index other : surface.cells[static_cast<Index>(v)]) {
      n_edges += 1;
      if (empty[v] == 0 || empty[at(other)] == 0) continue;
      const double before = squared_norm(surface.first_frame[at(other)] - surface.first_frame[v]);
      const double now = squared_norm(surface.x[at(other)] - surface.x[v]);
      const auto [less, more] = std::minmax(before, now);
      if (more > largest_stretch * largest_stretch * less) n_bridging += 1;
    }
  }
  return n_edges > 0 ? n_bridging / n_edges : 0;
}

}  // namespace

Coverage coverage_of(const SeenSurface& surface, const Measurement& scan,
                     const TrackingConstants& tracking, const RegistrationConstants& constants) {
  const double sparse = std::min(constants.empty_spacings * spacing_of(surface, scan.size()),
                                 constants.largest_empty_radius * size_of(surface.x));
  const double near = std::max(tracking.observed_distance * surface.mean_edge, sparse);
  const auto n_seen = static_cast<double>(
      std::ranges::count_if(surface.seen, [](Sight sight) { return sight != Sight::hidden; }));
  if (n_seen == 0) return {};
  const auto empty = find_empty(surface, scan, near, tracking.agreement);
  const double around = std::max(constants.bridging_edges * surface.mean_edge, sparse);
  const auto alone = find_empty(surface, scan, around, 0);
  return {static_cast<double>(std::ranges::count(empty, 1)) / n_seen,
          share_bridging(surface, alone, constants.bridging_stretch)};
}

}  // namespace dynmesh
