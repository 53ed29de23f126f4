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

/// (k,) which vertices have no point within a radius.
std::vector<std::uint8_t> find_alone(const SeenSurface& surface, const Measurement& scan,
                                     double radius, double agreement) {
  std::vector<std::uint8_t> alone(surface.x.size());
  for (std::size_t v = 0; v < alone.size(); ++v) {
    // A sheet that is seen from both sides is measured from either.
    const bool is_either = surface.seen[v] == Sight::both;
    const auto nearest = is_either
                             ? scan.nearest_of_both_sides(surface.x[v], surface.normals[v], radius,
                                                          agreement, Measurement::no_guess)
                             : scan.nearest(surface.x[v], surface.normals[v], radius, agreement,
                                            Measurement::no_guess);
    alone[v] = nearest.weight == 0 ? 1 : 0;
  }
  return alone;
}

/// Finds how edges are stretched.
void find_stretched(const SeenSurface& surface, std::span<const std::uint8_t> alone,
                    double largest_stretch, Coverage& coverage) {
  struct Sum {
    double edges = 0;
    double stretched = 0;
    double stretch = 0;  ///< 1 - the shorter length / the longer one
  };
  Sum measured;
  Sum unmeasured;
  for (std::size_t v = 0; v < surface.x.size(); ++v) {
    for (const Index other : surface.cells[static_cast<Index>(v)]) {
      const double before = squared_norm(surface.first_frame[at(other)] - surface.first_frame[v]);
      const double now = squared_norm(surface.x[at(other)] - surface.x[v]);
      const auto [less, more] = std::minmax(before, now);
      Sum& sum = alone[v] != 0 && alone[at(other)] != 0 ? unmeasured : measured;
      sum.edges += 1;
      if (more > largest_stretch * largest_stretch * less) sum.stretched += 1;
      if (more > 0) sum.stretch += 1 - std::sqrt(less / more);
    }
  }
  const double n_edges = measured.edges + unmeasured.edges;
  if (n_edges == 0) return;
  coverage.stretched = (measured.stretched + unmeasured.stretched) / n_edges;
  coverage.bridging = unmeasured.stretched / n_edges;
  const double usual = measured.edges > 0 ? measured.stretch / measured.edges : 0;
  coverage.bridging_excess = (unmeasured.stretch - usual * unmeasured.edges) / n_edges;
}

}  // namespace

Coverage coverage_of(const SeenSurface& surface, const Measurement& scan,
                     const TrackingConstants& tracking, const RegistrationConstants& constants) {
  const double sparse = std::min(constants.empty_spacings * spacing_of(surface, scan.size()),
                                 constants.largest_empty_radius * size_of(surface.x));
  const double near = std::max(tracking.observed_distance * surface.mean_edge, sparse);
  const auto empty = find_alone(surface, scan, near, tracking.agreement);
  double n_seen = 0;
  double n_empty = 0;
  for (std::size_t v = 0; v < empty.size(); ++v) {
    // The inside of a face or of clothes is not measured: something else is there.
    if (surface.seen[v] == Sight::hidden || surface.seen[v] == Sight::back) continue;
    n_seen += 1;
    if (empty[v] != 0) n_empty += 1;
  }
  Coverage coverage;
  if (n_seen == 0) return coverage;
  coverage.empty_share = n_empty / n_seen;
  const double around = std::max(constants.bridging_edges * surface.mean_edge, sparse);
  constexpr double any_normal = -2;
  find_stretched(surface, find_alone(surface, scan, around, any_normal), constants.bridging_stretch,
                 coverage);
  return coverage;
}

}  // namespace dynmesh
