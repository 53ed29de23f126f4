#include "tracking/vertex_normals.hpp"

#include <algorithm>
#include <cmath>

#include "support/geometry.hpp"

namespace dynmesh {
void find_vertex_normals(std::span<const Triangle> faces, std::span<const Vector3<double>> frame,
                         std::span<Vector3<double>> normals) {
  std::ranges::fill(normals, Vector3<double>{});
  for (const Triangle& face : faces) {
    const auto& a = frame[static_cast<std::size_t>(face[0])];
    const auto& b = frame[static_cast<std::size_t>(face[1])];
    const auto& c = frame[static_cast<std::size_t>(face[2])];
    const auto normal = cross(b - a, c - a);
    for (const Index v : face) {
      auto& sum = normals[static_cast<std::size_t>(v)];
      sum = sum + normal;
    }
  }
  for (auto& normal : normals) {
    const double length = std::sqrt(squared_norm(normal));
    normal = length > 0 && std::isfinite(length) ? (1 / length) * normal : Vector3<double>{};
  }
}

}  // namespace dynmesh
