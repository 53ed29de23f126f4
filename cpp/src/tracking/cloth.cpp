#include "tracking/cloth.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "support/geometry.hpp"
#include "support/symmetric_eigen.hpp"
#include "tracking/vertex_normals.hpp"

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

std::vector<std::array<Index, 2>> boundary_edges(std::span<const Triangle> faces) {
  std::vector<std::array<Index, 2>> edges;
  edges.reserve(3 * faces.size());
  for (const Triangle& face : faces) {
    for (std::size_t e = 0; e < 3; ++e) {
      edges.push_back({std::min(face[e], face[(e + 1) % 3]), std::max(face[e], face[(e + 1) % 3])});
    }
  }
  std::ranges::sort(edges);
  std::vector<std::array<Index, 2>> single;
  for (auto first = edges.begin(); first != edges.end();) {
    const auto next = std::upper_bound(first, edges.end(), *first);
    if (next - first == 1) single.push_back(*first);
    first = next;
  }
  return single;
}

std::vector<std::uint8_t> find_sheets(std::span<const Triangle> faces,
                                      std::span<const Index> component) {
  std::vector<double> n_boundary(component.size()), n_vertices(component.size());  // by component
  for (const auto& edge : boundary_edges(faces)) {
    n_boundary[static_cast<std::size_t>(component[static_cast<std::size_t>(edge[0])])] += 1;
  }
  for (const Index of : component) n_vertices[static_cast<std::size_t>(of)] += 1;
  std::vector<std::uint8_t> is_sheet(component.size());
  for (std::size_t v = 0; v < component.size(); ++v) {
    const auto of = static_cast<std::size_t>(component[v]);
    is_sheet[v] = n_boundary[of] * n_boundary[of] >= n_vertices[of] ? 1 : 0;
  }
  return is_sheet;
}

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
