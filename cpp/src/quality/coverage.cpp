#include "quality/coverage.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "base/geometry.hpp"
#include "base/point_tree.hpp"
#include "quality/limits.hpp"
#include "surface_fit/constants.hpp"

namespace dynmesh {

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

double overlap_of(const BentSurface& surface) {
  const double far = quality_limits.overlap_edges * surface.mean_edge;
  const PointTree<3> vertices(arrays_of(surface.x));
  const double squared_near = surface.mean_edge * surface.mean_edge;
  const auto areas = areas_of(surface.faces, surface.first_frame);
  double all = 0;
  double overlap = 0;
  for (std::size_t v = 0; v < areas.size(); ++v) {
    bool overlaps = false;
    vertices.search(array_of(surface.x[v]), squared_near, [&](std::uint32_t other, double) {
      overlaps = overlaps ||
                 (squared_norm(surface.first_frame[other] - surface.first_frame[v]) > far * far &&
                  dot(surface.normals[other], surface.normals[v]) > TrackingConstants{}.agreement);
      return overlaps ? 0 : squared_near;
    });
    all += areas[v];
    if (overlaps) overlap += areas[v];
  }
  return all > 0 ? overlap / all : 0;
}

}  // namespace dynmesh
