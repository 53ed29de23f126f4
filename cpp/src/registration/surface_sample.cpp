#include "registration/surface_sample.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "support/geometry.hpp"

namespace dynmesh {

/// In each face, the places follow the R2 sequence (Roberts 2018).
SurfaceSample sample_surface(std::span<const Triangle> faces, std::span<const Vector3<double>> x,
                             std::size_t n) {
  constexpr double first_step = 0.7548776662466927;
  constexpr double second_step = 0.5698402909980532;
  std::vector<double> ends;  // the area up to each face
  double total = 0;
  std::vector<Vector3<double>> normals;
  for (const Triangle& face : faces) {
    const auto corner = [&](std::size_t c) { return x[static_cast<std::size_t>(face[c])]; };
    const auto normal = cross(corner(1) - corner(0), corner(2) - corner(0));
    const double area = std::sqrt(squared_norm(normal));
    normals.push_back((area > 0 ? 1 / area : 0) * normal);
    ends.push_back(total += area);
  }
  SurfaceSample sample;
  if (!(total > 0)) return sample;
  for (std::size_t i = 0; i < n; ++i) {
    const auto number = static_cast<double>(i);
    const double area = (number + 0.5) / static_cast<double>(n) * total;
    const auto f = static_cast<std::size_t>(std::ranges::upper_bound(ends, area) - ends.begin());
    const Triangle& face = faces[std::min(f, faces.size() - 1)];
    const double root = std::sqrt(std::fmod(number * first_step, 1.0));
    const double along = std::fmod(number * second_step, 1.0);
    const std::array<double, 3> weights = {1 - root, root * (1 - along), root * along};
    Vector3<double> point;
    for (std::size_t c = 0; c < 3; ++c) {
      point = point + weights[c] * x[static_cast<std::size_t>(face[c])];
    }
    sample.points.push_back(point);
    sample.normals.push_back(normals[std::min(f, faces.size() - 1)]);
    sample.vertices.push_back(
        face[static_cast<std::size_t>(std::ranges::max_element(weights) - weights.begin())]);
  }
  return sample;
}

PointScan sample_scan(const PointScan& scan, std::size_t n) {
  PointScan sample;
  const double step = std::max(1.0, static_cast<double>(scan.size()) / static_cast<double>(n));
  for (double next = 0; next < static_cast<double>(scan.size()); next += step) {
    const auto i = static_cast<std::size_t>(next);
    sample.points.push_back(scan.points[i]);
    sample.normals.push_back(scan.normals[i]);
    sample.undecided.push_back(scan.is_undecided(i) ? 1 : 0);
  }
  sample.sensors = scan.sensors;
  sample.index();
  return sample;
}

}  // namespace dynmesh
