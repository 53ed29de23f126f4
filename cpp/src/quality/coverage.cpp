#include "quality/coverage.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>
#include <utility>

#include "base/geometry.hpp"
#include "quality/limits.hpp"
#include "surface_fit/constants.hpp"

namespace dynmesh {
namespace {

/// The least cosine between normals of the same surface.
const double least_agreement = TrackingConstants{}.agreement;

/// The area of the vertices beside which others lie that are far away in the template.
double overlapping_area(const BentSurface& surface, std::span<const double> areas) {
  const double far = quality_limits.overlap_edges * surface.mean_edge;
  const PointTree<3> vertices(arrays_of(surface.x));
  const double squared_near = surface.mean_edge * surface.mean_edge;
  double overlap = 0;
  for (std::size_t v = 0; v < areas.size(); ++v) {
    bool overlaps = false;
    vertices.search(array_of(surface.x[v]), squared_near, [&](std::uint32_t other, double) {
      overlaps = overlaps ||
                 (squared_norm(surface.first_frame[other] - surface.first_frame[v]) > far * far &&
                  dot(surface.normals[other], surface.normals[v]) > least_agreement);
      return overlaps ? 0 : squared_near;
    });
    if (overlaps) overlap += areas[v];
  }
  return overlap;
}

}  // namespace

std::vector<double> areas_of(std::span<const Triangle> faces, Field x) {
  std::vector<double> areas(x.size());
  for (const Triangle& face : faces) {
    const double twice = std::sqrt(squared_norm(normal_of(face, x)));
    for (const Index v : face) areas[at(v)] += twice / 6;
  }
  return areas;
}

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

std::vector<std::uint8_t> find_seen(const BentSurface& surface, Field viewpoints) {
  // Neighbours on the same slope, up to 60 degrees from the view, do not hide each other.
  const double thickness = 1.5 * surface.mean_edge;
  const std::size_t n = surface.x.size();
  std::vector<std::uint8_t> seen(n, viewpoints.empty() ? 1 : 0);
  for (const auto& viewpoint : viewpoints) {
    std::vector<Vector3> directions;
    std::vector<double> depths(n);
    for (std::size_t v = 0; v < n; ++v) {
      const auto arm = surface.x[v] - viewpoint;
      depths[v] = std::sqrt(squared_norm(arm));
      directions.push_back((depths[v] > 0 ? 1 / depths[v] : 0) * arm);
    }
    const PointTree<3> tree(arrays_of(directions));
    for (std::size_t v = 0; v < n; ++v) {
      const auto& direction = directions[v];
      if (seen[v] != 0 || !(depths[v] > 0)) continue;
      // The inside of a face or of clothes is not measured: something else is there.
      if (!(dot(surface.normals[v], direction) < 0)) continue;
      seen[v] = 1;
      const double squared_near = std::pow(surface.mean_edge / depths[v], 2);
      tree.search(array_of(direction), squared_near, [&](std::uint32_t other, double) {
        if (depths[other] < depths[v] - thickness) seen[v] = 0;
        return seen[v] != 0 ? squared_near : 0;
      });
    }
  }
  return seen;
}

Coverage coverage_of(const BentSurface& surface, const PointScan& scan) {
  const auto seen = find_seen(surface, scan.sensors);
  const auto now = areas_of(surface.faces, surface.x);
  double seen_area = 0;
  for (std::size_t v = 0; v < now.size(); ++v) seen_area += seen[v] != 0 ? now[v] : 0;
  Coverage coverage;
  if (!(seen_area > 0)) return coverage;
  const double spacing = std::sqrt(seen_area / static_cast<double>(scan.size()));
  // A few points are not everywhere on a surface, however sparse they are.
  const double sparse = std::min(quality_limits.hole_spacings * spacing, 0.15 * surface.size);
  const double near = std::max(quality_limits.hole_edges * surface.mean_edge, sparse);
  std::vector<std::uint8_t> is_in_hole(now.size());
  for (std::size_t v = 0; v < now.size(); ++v) {
    if (seen[v] == 0) continue;
    const auto& normal = surface.normals[v];
    const bool is_measured = scan.any_agrees(surface.x[v], normal, near, least_agreement) ||
                             (surface.is_sheet[v] != 0 &&
                              scan.any_agrees(surface.x[v], -1.0 * normal, near, least_agreement));
    is_in_hole[v] = is_measured ? 0 : 1;
  }
  auto shares = areas_of(surface.faces, surface.first_frame);
  const double all = std::accumulate(shares.begin(), shares.end(), 0.0);
  for (double& share : shares) share = all > 0 ? share / all : 0;
  coverage.hole = largest_piece(surface.topology.cells, shares, std::move(is_in_hole));
  coverage.overlap = overlapping_area(surface, shares);
  return coverage;
}

}  // namespace dynmesh
