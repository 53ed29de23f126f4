#include "surface_fit/membrane.hpp"

#include <algorithm>
#include <cmath>

#include "base/geometry.hpp"
#include "mesh/intrinsic_delaunay.hpp"
#include "shape/detail_operator.hpp"

namespace dynmesh {

Membrane::Membrane(std::span<const Triangle> faces, Field first_frame, double mean_edge,
                   std::span<const double> mu, Workers& workers)
    : workers_(workers) {
  // Triangles that are narrower than this share of their side have no plane.
  constexpr double least_height = 1e-6;
  for (const IntrinsicTriangle& triangle : intrinsic_delaunay(faces, first_frame, mean_edge)) {
    Rest rest{};
    for (std::size_t s = 0; s < 3; ++s) {
      rest.corners[s] = static_cast<std::size_t>(triangle.vertices[s]);
      rest.weights[s] = mu[rest.corners[s]] * triangle.cotangent(s) / 2;
    }
    const auto& origin = first_frame[rest.corners[0]];
    const auto first = first_frame[rest.corners[1]] - origin;
    const auto second = first_frame[rest.corners[2]] - origin;
    rest.x1 = std::sqrt(squared_norm(first));
    if (!(rest.x1 > 0)) continue;
    rest.x2 = dot(first, second) / rest.x1;
    rest.y2 = std::sqrt(std::max(0.0, squared_norm(second) - rest.x2 * rest.x2));
    if (rest.y2 > least_height * rest.x1) triangles_.push_back(rest);
  }
  forces_.resize(triangles_.size());
}

/// The sides in frame 0 as the rotation that is nearest to the present triangle turns them:
/// J (J^T J)^(-1/2), where J maps the plane of frame 0 to space.
Membrane::Sides Membrane::turned_sides(const Rest& rest, Field x) {
  const auto& [a, b, c] = rest.corners;
  const auto u = (1 / rest.x1) * (x[b] - x[a]);
  const auto v = (1 / rest.y2) * ((x[c] - x[a]) - rest.x2 * u);
  const double uu = squared_norm(u);
  const double uv = dot(u, v);
  const double vv = squared_norm(v);
  const double determinant = std::sqrt(std::max(0.0, uu * vv - uv * uv));
  constexpr double collapsed = 1e-9;
  if (!(determinant > collapsed)) return {x[a] - x[b], x[b] - x[c], x[c] - x[a]};
  const double scale = determinant * std::sqrt(uu + vv + 2 * determinant);
  const auto along = (1 / scale) * ((vv + determinant) * u - uv * v);
  const auto across = (1 / scale) * ((uu + determinant) * v - uv * u);
  const auto first = rest.x1 * along;
  const auto second = rest.x2 * along + rest.y2 * across;
  return {-1.0 * first, first - second, second};
}

void Membrane::add_forces(Field x, std::span<Vector3> forces) {
  workers_.for_each_short_chunk(static_cast<Index>(triangles_.size()), [&](Index begin, Index end) {
    for (auto t = static_cast<std::size_t>(begin); t < static_cast<std::size_t>(end); ++t) {
      const Rest& rest = triangles_[t];
      const Sides sides = turned_sides(rest, x);
      for (std::size_t s = 0; s < 3; ++s) {
        const auto side = x[rest.corners[s]] - x[rest.corners[(s + 1) % 3]];
        forces_[t][s] = rest.weights[s] * (sides[s] - side);
      }
    }
  });
  // In one order, so that the sums are the same for any number of threads.
  for (std::size_t t = 0; t < triangles_.size(); ++t) {
    const auto& corners = triangles_[t].corners;
    for (std::size_t s = 0; s < 3; ++s) {
      forces[corners[s]] = forces[corners[s]] + forces_[t][s];
      forces[corners[(s + 1) % 3]] = forces[corners[(s + 1) % 3]] - forces_[t][s];
    }
  }
}

}  // namespace dynmesh
