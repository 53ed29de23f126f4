/// Scans and depth images of the meshes of the tests.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <dynmesh/tracker.hpp>
#include <vector>

#include "meshes.hpp"

namespace dynmesh::testing {

/// A torus with bumps, on which every place can be told from all others.
inline Mesh<double> bumpy_torus(int n) {
  Mesh<double> mesh = torus(n);
  for (std::size_t v = 0; v < mesh.size(); ++v) {
    const double i = static_cast<double>(v / static_cast<std::size_t>(n)) / n;
    const double j = static_cast<double>(v % static_cast<std::size_t>(n)) / n;
    const double bump = 0.25 * std::sin(6.2832 * (2 * i + j)) + 0.2 * std::sin(6.2832 * 3 * i);
    for (std::size_t c = 0; c < 2; ++c) mesh.vertices[3 * v + c] *= 1 + 0.3 * bump;
    mesh.vertices[3 * v + 2] *= 1 + bump;
  }
  return mesh;
}

inline double mean_edge(const Mesh<double>& mesh) {
  double sum = 0;
  for (std::size_t i = 0; i < mesh.indices.size(); ++i) {
    const auto a = static_cast<std::size_t>(mesh.indices[i]);
    const auto b = static_cast<std::size_t>(mesh.indices[i % 3 == 2 ? i - 2 : i + 1]);
    sum += std::hypot(mesh.vertices[3 * a] - mesh.vertices[3 * b],
                      mesh.vertices[3 * a + 1] - mesh.vertices[3 * b + 1],
                      mesh.vertices[3 * a + 2] - mesh.vertices[3 * b + 2]);
  }
  return sum / static_cast<double>(mesh.indices.size());
}

struct Samples {
  std::vector<double> points, normals, viewpoints;
  bool has_normals = true;
};

/// Points spread over all faces of the mesh, whose vertices are at `vertices`, with the normals of
/// the faces interpolated between the vertices.
inline Samples scan_of(const Mesh<double>& mesh, const std::vector<double>& vertices) {
  using Vector = std::array<double, 3>;
  const auto at = [&](Index v) {
    const auto i = 3 * static_cast<std::size_t>(v);
    return Vector{vertices[i], vertices[i + 1], vertices[i + 2]};
  };
  std::vector<Vector> normals(vertices.size() / 3, Vector{});
  for (std::size_t f = 0; f < mesh.indices.size(); f += 3) {
    const Vector a = at(mesh.indices[f]);
    const Vector b = at(mesh.indices[f + 1]);
    const Vector c = at(mesh.indices[f + 2]);
    for (std::size_t e = 0; e < 3; ++e) {
      auto& normal = normals[static_cast<std::size_t>(mesh.indices[f + e])];
      for (std::size_t d = 0; d < 3; ++d) {
        const std::size_t x = (d + 1) % 3;
        const std::size_t y = (d + 2) % 3;
        normal[d] += (b[x] - a[x]) * (c[y] - a[y]) - (b[y] - a[y]) * (c[x] - a[x]);
      }
    }
  }
  Samples scan;
  constexpr int steps = 4;
  for (std::size_t f = 0; f < mesh.indices.size(); f += 3) {
    for (int i = 0; i <= steps; ++i) {
      for (int j = 0; i + j <= steps; ++j) {
        const double u = static_cast<double>(i) / steps;
        const double v = static_cast<double>(j) / steps;
        const std::array<double, 3> share = {1 - u - v, u, v};
        for (std::size_t d = 0; d < 3; ++d) {
          double point = 0;
          double normal = 0;
          for (std::size_t e = 0; e < 3; ++e) {
            const Index corner = mesh.indices[f + e];
            point += share[e] * at(corner)[d];
            normal += share[e] * normals[static_cast<std::size_t>(corner)][d];
          }
          scan.points.push_back(point);
          scan.normals.push_back(normal);
        }
      }
    }
  }
  return scan;
}

template <class Real>
std::vector<Real> track(Tracker<Real>& tracker, const Samples& samples) {
  const std::vector<Real> points(samples.points.begin(), samples.points.end());
  const std::vector<Real> normals(samples.normals.begin(), samples.normals.end());
  const std::vector<Real> viewpoints(samples.viewpoints.begin(), samples.viewpoints.end());
  Scan<Real> scan;
  scan.points = {points.data(), points.size() / 3};
  if (samples.has_normals) scan.normals = {normals.data(), normals.size() / 3};
  scan.viewpoints = {viewpoints.data(), viewpoints.size() / 3};
  std::vector<Real> tracked(3 * tracker.n_vertices());
  tracker.push(scan, {tracked.data(), tracker.n_vertices()});
  return tracked;
}

struct Image {
  std::vector<float> pixels;
  int side = 0;
  std::array<double, 9> intrinsics{};
  std::array<double, 16> pose{};

  [[nodiscard]] DepthImage view() const {
    const auto n = static_cast<std::size_t>(side);
    return {pixels.data(), n, n, side, 1, intrinsics, pose};
  }
};

/// Square depth images of points of the mesh, from cameras around z, which look at the origin from
/// a height.
inline std::vector<Image> images_of(const Mesh<double>& mesh, const std::vector<double>& vertices,
                                    int n_cameras, int side) {
  using Vector = std::array<double, 3>;
  const auto points = scan_of(mesh, vertices).points;
  std::vector<Image> images;
  for (int n = 0; n < n_cameras; ++n) {
    const double angle = 0.4 + 6.283185307 * n / n_cameras;
    const double tilt = 0.7;
    const Vector back = {std::cos(tilt) * std::cos(angle), std::cos(tilt) * std::sin(angle),
                         std::sin(tilt)};
    const Vector right = {-std::sin(angle), std::cos(angle), 0};
    const Vector down = {std::sin(tilt) * std::cos(angle), std::sin(tilt) * std::sin(angle),
                         -std::cos(tilt)};
    Image image;
    image.side = side;
    image.pixels.assign(static_cast<std::size_t>(side) * static_cast<std::size_t>(side), 0.0F);
    const double focal = 1.5 * side;
    const double centre = 0.5 * side;
    image.intrinsics = {focal, 0, centre, 0, focal, centre, 0, 0, 1};
    for (std::size_t d = 0; d < 3; ++d) {
      image.pose[4 * d] = right[d];
      image.pose[4 * d + 1] = down[d];
      image.pose[4 * d + 2] = -back[d];
      image.pose[4 * d + 3] = 15 * back[d];
    }
    image.pose[15] = 1;
    for (std::size_t p = 0; p < points.size(); p += 3) {
      Vector arm{};
      for (std::size_t i = 0; i < 9; ++i) {
        arm[i % 3] +=
            image.pose[4 * (i / 3) + i % 3] * (points[p + i / 3] - image.pose[4 * (i / 3) + 3]);
      }
      const double column = std::round(focal * arm[0] / arm[2] + centre);
      const double row = std::round(focal * arm[1] / arm[2] + centre);
      if (std::min(column, row) < 0 || std::max(column, row) >= side) continue;
      float& pixel = image.pixels[static_cast<std::size_t>(row * side + column)];
      const auto depth = static_cast<float>(arm[2]);
      if (pixel == 0 || depth < pixel) pixel = depth;
    }
    images.push_back(image);
  }
  return images;
}

}  // namespace dynmesh::testing
