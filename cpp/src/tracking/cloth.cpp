#include "tracking/cloth.hpp"

#include <Eigen/Dense>
#include <cmath>

#include "support/eigen_points.hpp"
#include "support/geometry.hpp"
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
  Eigen::Matrix<double, 6, 6> sum = Eigen::Matrix<double, 6, 6>::Zero();
  for (const std::size_t v : vertices) {
    const auto turn = cross((1 / radius) * (x[v] - centre), normals[v]);
    Eigen::Vector<double, 6> row;
    row << turn.x, turn.y, turn.z, normals[v].x, normals[v].y, normals[v].z;
    sum += row * row.transpose() / n;
  }
  return Eigen::SelfAdjointEigenSolver<Eigen::Matrix<double, 6, 6>>(sum, Eigen::EigenvaluesOnly)
      .eigenvalues()[0];
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
