#include "tracking/cloth.hpp"

#include <array>
#include <cmath>

#include "support/geometry.hpp"
#include "support/symmetric_eigen.hpp"
#include "tracking/vertex_normals.hpp"
#include "tracking/visibility.hpp"

namespace dynmesh {
namespace {

using Field = std::span<const Vector3<double>>;

/// The mean square of how far the planes move in the rigid motion that they notice least, where it
/// moves the vertices by 1.
double slippage(std::span<const std::size_t> vertices, Field x, Field normals) {
  const double n = static_cast<double>(vertices.size());
  Vector3<double> centre;
  for (const std::size_t v : vertices) centre = centre + (1 / n) * x[v];
  double square = 0;
  for (const std::size_t v : vertices) square += squared_norm(x[v] - centre) / n;
  if (!(square > 0) || !std::isfinite(square)) return 1;
  const double radius = std::sqrt(square);
  std::array<double, 36> sum{};
  for (const std::size_t v : vertices) {
    const auto turn = cross((1 / radius) * (x[v] - centre), normals[v]);
    const std::array<double, 6> row = {turn.x,       turn.y,       turn.z,
                                       normals[v].x, normals[v].y, normals[v].z};
    for (std::size_t i = 0; i < 6; ++i) {
      for (std::size_t j = 0; j < 6; ++j) sum[6 * i + j] += row[i] * row[j] / n;
    }
  }
  std::array<double, 6> values{};
  symmetric_eigen(sum, values);
  return values[0];
}

}  // namespace

std::vector<std::uint8_t> find_cloth(std::span<const Triangle> faces,
                                     std::span<const Index> component, Field first_frame,
                                     const TrackingConstants& constants) {
  std::vector<std::uint8_t> is_cloth = find_sheets(faces, component);
  std::vector<Vector3<double>> normals(first_frame.size());
  find_vertex_normals(faces, first_frame, normals);
  std::vector<std::vector<std::size_t>> sheets(component.size());  // by component
  for (std::size_t v = 0; v < component.size(); ++v) {
    if (is_cloth[v] != 0) sheets[static_cast<std::size_t>(component[v])].push_back(v);
  }
  for (const auto& vertices : sheets) {
    if (vertices.empty()) continue;
    const bool slides = slippage(vertices, first_frame, normals) < constants.largest_slippage;
    for (const std::size_t v : vertices) is_cloth[v] = slides ? 1 : 0;
  }
  return is_cloth;
}

}  // namespace dynmesh
