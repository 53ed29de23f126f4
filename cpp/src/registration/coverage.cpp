#include "registration/coverage.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <utility>
#include <vector>

#include "support/geometry.hpp"
#include "support/indices.hpp"
#include "tracking/point_scan.hpp"
#include "tracking/robust_size.hpp"

namespace dynmesh {
namespace {

double area_of(std::span<const Vector3<double>> x, const Triangle& face) {
  const auto corner = [&](std::size_t c) { return x[at(face[c])]; };
  return std::sqrt(squared_norm(cross(corner(1) - corner(0), corner(2) - corner(0)))) / 2;
}

/// The mean distance between points that are spread over what the sensors should see.
double spacing_of(const SeenSurface& surface, std::size_t n_points) {
  double area = 0;
  for (const Triangle& face : surface.faces) {
    const double third = area_of(surface.x, face) / 3;
    for (const Index v : face) {
      if (surface.seen[at(v)] != Sight::hidden) area += third;
    }
  }
  return std::sqrt(area / static_cast<double>(n_points));
}

/// (k,) the squared distance from each vertex to the nearest point whose normal agrees; infinite
/// beyond a radius.
std::vector<double> squared_distances(const SeenSurface& surface, const PointScan& scan,
                                      double radius, double agreement) {
  std::vector<double> distances(surface.x.size(), std::numeric_limits<double>::infinity());
  for (std::size_t v = 0; v < distances.size(); ++v) {
    // A sheet that is seen from both sides is measured from either.
    auto nearest = scan.find(surface.x[v], surface.normals[v], radius, agreement);
    if (surface.seen[v] == Sight::both) {
      const auto back = scan.find(surface.x[v], -1.0 * surface.normals[v], radius, agreement);
      if (back.squared_distance < nearest.squared_distance) nearest = back;
    }
    distances[v] = nearest.squared_distance;
  }
  return distances;
}

/// (k,) the shares of the vertices in the area of the template.
std::vector<double> shares_of_area(const SeenSurface& surface) {
  std::vector<double> shares(surface.x.size());
  double all = 0;
  for (const Triangle& face : surface.faces) {
    const double area = area_of(surface.first_frame, face);
    all += area;
    for (const Index v : face) shares[at(v)] += area / 3;
  }
  for (double& share : shares) share = all > 0 ? share / all : 0;
  return shares;
}

/// The area of the largest connected piece of those vertices.
double largest_piece(const Cells& cells, std::span<const double> areas,
                     std::vector<std::uint8_t> is_in) {
  double largest = 0;
  std::vector<Index> front;
  for (std::size_t first = 0; first < is_in.size(); ++first) {
    double area = 0;
    const auto take = [&](Index v) {
      if (std::exchange(is_in[at(v)], std::uint8_t{0}) == 0) return;
      area += areas[at(v)];
      front.push_back(v);
    };
    take(static_cast<Index>(first));
    while (!front.empty()) {
      const Index v = front.back();
      front.pop_back();
      for (const Index other : cells[v]) take(other);
    }
    largest = std::max(largest, area);
  }
  return largest;
}

/// The area of the vertices beside which others lie that are far away in the template.
double overlapping_area(const SeenSurface& surface, std::span<const double> areas,
                        const RegistrationConstants& constants) {
  const double far = constants.overlap_edges * surface.mean_edge;
  // Layers of a folded sheet face opposite ways, whichever side is seen.
  const auto outward = [&](std::size_t v) {
    return (surface.seen[v] == Sight::back ? -1.0 : 1.0) * surface.normals[v];
  };
  PointScan vertices;
  vertices.points.assign(surface.x.begin(), surface.x.end());
  vertices.index();
  double overlap = 0;
  for (std::size_t v = 0; v < areas.size(); ++v) {
    bool overlaps = false;
    vertices.for_each_within(surface.x[v], surface.mean_edge, [&](std::uint32_t other) {
      overlaps = overlaps ||
                 (squared_norm(surface.first_frame[other] - surface.first_frame[v]) > far * far &&
                  dot(outward(other), outward(v)) > constants.overlap_cosine);
    });
    if (overlaps) overlap += areas[v];
  }
  return overlap;
}

/// Finds how edges are stretched.
void find_stretched(const SeenSurface& surface, std::span<const double> distances,
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
      Sum& sum =
          std::isinf(distances[v]) && std::isinf(distances[at(other)]) ? unmeasured : measured;
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

Coverage coverage_of(const SeenSurface& surface, const PointScan& scan,
                     const TrackingConstants& tracking, const RegistrationConstants& constants) {
  const double sparse = std::min(constants.empty_spacings * spacing_of(surface, scan.size()),
                                 constants.largest_empty_radius * size_of(surface.x));
  const double near = std::max(tracking.observed_distance * surface.mean_edge, sparse);
  const double around_hole = constants.hole_distance * near;
  const auto distances = squared_distances(surface, scan, around_hole, tracking.agreement);
  std::vector<std::uint8_t> is_in_hole(distances.size());
  double n_seen = 0;
  double n_empty = 0;
  for (std::size_t v = 0; v < distances.size(); ++v) {
    // The inside of a face or of clothes is not measured: something else is there.
    if (surface.seen[v] == Sight::hidden || surface.seen[v] == Sight::back) continue;
    n_seen += 1;
    if (distances[v] > near * near) n_empty += 1;
    is_in_hole[v] = std::isinf(distances[v]) ? 1 : 0;
  }
  Coverage coverage;
  if (n_seen == 0) return coverage;
  coverage.empty_share = n_empty / n_seen;
  const auto areas = shares_of_area(surface);
  coverage.hole = largest_piece(surface.cells, areas, std::move(is_in_hole));
  coverage.overlap = overlapping_area(surface, areas, constants);
  const double around = std::max(constants.bridging_edges * surface.mean_edge, sparse);
  constexpr double any_normal = -2;
  find_stretched(surface, squared_distances(surface, scan, around, any_normal),
                 constants.bridging_stretch, coverage);
  return coverage;
}

}  // namespace dynmesh
