/// Scans and depth images of the meshes of the tests.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <dynmesh/tracker.hpp>
#include <vector>

#include "base/geometry.hpp"
#include "meshes.hpp"
#include "surface_fit/surface_places.hpp"

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

struct Samples {
  std::vector<double> points, normals, viewpoints, colours;
  bool has_normals = true;
};

/// Points spread over all faces of the mesh, whose vertices are at `vertices`, with the normals of
/// the faces interpolated between the vertices.
inline Samples scan_of(const Mesh<double>& mesh, const std::vector<double>& vertices) {
  const auto faces = triangles_of(mesh);
  const auto positions = rows_of(vertices);
  const auto normals = vertex_normals(faces, positions);
  Samples scan;
  constexpr int steps = 4;
  for (const Triangle& f : faces) {
    for (int i = 0; i <= steps; ++i) {
      for (int j = 0; i + j <= steps; ++j) {
        const double u = static_cast<double>(i) / steps;
        const double v = static_cast<double>(j) / steps;
        const auto add = [&](const auto& values, std::vector<double>& to) {
          const auto mean = (1 - u - v) * values[f[0]] + u * values[f[1]] + v * values[f[2]];
          to.insert(to.end(), {mean.x, mean.y, mean.z});
        };
        add(positions, scan.points);
        add(normals, scan.normals);
      }
    }
  }
  return scan;
}

/// The samples as a tracker takes them.
inline Scan<double> view_of(const Samples& samples) {
  Scan<double> scan;
  scan.points = {samples.points.data(), samples.points.size() / 3};
  if (samples.has_normals) scan.normals = {samples.normals.data(), samples.normals.size() / 3};
  scan.viewpoints = {samples.viewpoints.data(), samples.viewpoints.size() / 3};
  if (!samples.colours.empty()) scan.colours = {samples.colours.data(), samples.colours.size() / 3};
  return scan;
}

inline std::vector<double> track(Tracker<double>& tracker, const Samples& samples) {
  std::vector<double> tracked(3 * tracker.n_vertices());
  tracker.push(view_of(samples), {tracked.data(), tracker.n_vertices()});
  return tracked;
}

struct Image {
  std::vector<float> pixels;
  int side = 0;
  std::array<double, 9> intrinsics{};
  std::array<double, 16> pose{};

  [[nodiscard]] DepthImage view() const {
    const auto n = static_cast<std::size_t>(side);
    return {pixels.data(), n, n, side, 1, intrinsics, pose, nullptr};
  }
};

/// Square depth images of points of the mesh, from cameras around z, which look at the origin from
/// a height.
inline std::vector<Image> images_of(const Mesh<double>& mesh, const std::vector<double>& vertices,
                                    int n_cameras, int side) {
  const auto points = rows_of(scan_of(mesh, vertices).points);
  std::vector<Image> images;
  for (int n = 0; n < n_cameras; ++n) {
    const double angle = 0.4 + 6.283185307 * n / n_cameras;
    const double tilt = 0.7;
    const Vector3 back = {std::cos(tilt) * std::cos(angle), std::cos(tilt) * std::sin(angle),
                          std::sin(tilt)};
    const Vector3 right = {-std::sin(angle), std::cos(angle), 0};
    const Vector3 down = cross(right, back);
    const Vector3 position = 15.0 * back;
    const double focal = 1.5 * side;
    const double centre = 0.5 * side;
    Image image;
    image.side = side;
    image.pixels.assign(static_cast<std::size_t>(side) * static_cast<std::size_t>(side), 0.0F);
    image.intrinsics = {focal, 0, centre, 0, focal, centre, 0, 0, 1};
    image.pose = {right.x, down.x, -back.x, position.x, right.y, down.y, -back.y, position.y,
                  right.z, down.z, -back.z, position.z, 0,       0,      0,       1};
    for (const auto& point : points) {
      const auto arm = point - position;
      const auto depth = static_cast<float>(-dot(arm, back));
      const double column = std::round(focal * dot(arm, right) / depth + centre);
      const double row = std::round(focal * dot(arm, down) / depth + centre);
      if (std::min(column, row) < 0 || std::max(column, row) >= side) continue;
      float& pixel = image.pixels[static_cast<std::size_t>(row * side + column)];
      if (pixel == 0 || depth < pixel) pixel = depth;
    }
    images.push_back(image);
  }
  return images;
}

}  // namespace dynmesh::testing
