#include "registration/targets.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <stdexcept>
#include <string>

#include "stream/arguments.hpp"
#include "support/geometry.hpp"
#include "support/rigid_motion.hpp"
#include "tracking/scan_arguments.hpp"

namespace dynmesh {

template <class Real>
void check_landmarks(const Landmarks<Real>& landmarks, std::size_t n_vertices) {
  if (landmarks.positions.count != landmarks.vertices.size()) {
    throw std::invalid_argument("landmarks: there are " +
                                std::to_string(landmarks.vertices.size()) + " vertices, but " +
                                std::to_string(landmarks.positions.count) + " positions");
  }
  check_scan("landmarks", landmarks.positions);
  const auto position = [&](std::size_t i) { return row(landmarks.positions, i); };
  for (std::size_t i = 0; i < landmarks.vertices.size(); ++i) {
    const Index vertex = landmarks.vertices[i];
    if (vertex < 0 || static_cast<std::size_t>(vertex) >= n_vertices) {
      throw std::invalid_argument("landmarks: landmark " + std::to_string(i) + " is of vertex " +
                                  std::to_string(vertex) + ", but the template has " +
                                  std::to_string(n_vertices) + " vertices, counted from 0");
    }
    for (std::size_t j = 0; j < i; ++j) {
      const std::string both = "landmarks: landmarks " + std::to_string(j) + " and " +
                               std::to_string(i) + " contradict each other: ";
      if (landmarks.vertices[j] == vertex) {
        throw std::invalid_argument(both + "both are of vertex " + std::to_string(vertex));
      }
      if (squared_norm(position(i) - position(j)) == 0) {
        throw std::invalid_argument(both + "vertices " + std::to_string(landmarks.vertices[j]) +
                                    " and " + std::to_string(vertex) + " are both at " +
                                    to_text(position(i)));
      }
    }
  }
}

template void check_landmarks(const Landmarks<float>&, std::size_t);
template void check_landmarks(const Landmarks<double>&, std::size_t);

void check_places(std::span<const Vector3<double>> positions, const PointScan& scan, double size) {
  Vector3<double> least = scan.points[0];
  Vector3<double> most = least;
  for (std::size_t i = 0; i < scan.size(); ++i) {
    const auto& x = scan.points[i];
    least = {std::min(least.x, x.x), std::min(least.y, x.y), std::min(least.z, x.z)};
    most = {std::max(most.x, x.x), std::max(most.y, x.y), std::max(most.z, x.z)};
  }
  for (std::size_t i = 0; i < positions.size(); ++i) {
    const auto& x = positions[i];
    const Vector3<double> nearest = {std::clamp(x.x, least.x, most.x),
                                     std::clamp(x.y, least.y, most.y),
                                     std::clamp(x.z, least.z, most.z)};
    const double distance = std::sqrt(squared_norm(x - nearest));
    // No template reaches farther than twice its size beyond what was measured of it.
    if (!(distance > 2 * size)) continue;
    std::array<char, 200> text{};
    (void)std::snprintf(
        text.data(), text.size(),
        "landmarks: the position of landmark %zu, (%.6g, %.6g, %.6g), is %.4g outside "
        "the scan; it must be in the unit and the axes of the scan",
        i, x.x, x.y, x.z, distance);
    throw std::invalid_argument(text.data());
  }
}

bool Targets::determine_a_rotation() const {
  constexpr double collinear = 1e-3;
  double longest = 0;
  double widest = 0;
  for (const auto& a : positions) {
    const auto arm = a - positions[0];
    longest = std::max(longest, squared_norm(arm));
    for (const auto& b : positions) {
      widest = std::max(widest, squared_norm(cross(arm, b - positions[0])));
    }
  }
  return widest > collinear * longest * longest;
}

Eigen::Isometry3d Targets::motion_from(std::span<const Vector3<double>> frame) const {
  std::vector<Vector3<double>> wanted(frame.begin(), frame.end());
  for (std::size_t i = 0; i < vertices.size(); ++i) {
    wanted[static_cast<std::size_t>(vertices[i])] = positions[i];
  }
  return to_eigen(fit_rigid_motion<double>(vertices, frame, wanted));
}

}  // namespace dynmesh
