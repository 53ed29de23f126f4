#include "tracking/cloth.hpp"

#include <doctest/doctest.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <dynmesh/tracker.hpp>
#include <utility>
#include <vector>

#include "meshes.hpp"
#include "scans.hpp"
#include "support/workers.hpp"
#include "tracking/membrane.hpp"

namespace dynmesh::testing {
namespace {

/// A flat square of n by n vertices at distances of 1, around the origin.
Mesh<double> flat_sheet(int n) {
  Mesh<double> mesh;
  for (int i = 0; i < n; ++i) {
    for (int j = 0; j < n; ++j) {
      mesh.vertices.insert(mesh.vertices.end(), {i - 0.5 * (n - 1), j - 0.5 * (n - 1), 0.0});
      if (i + 1 == n || j + 1 == n) continue;
      const Index a = i * n + j;
      mesh.indices.insert(mesh.indices.end(), {a, a + n, a + 1, a + 1, a + n, a + n + 1});
    }
  }
  return mesh;
}

Mesh<double> with_opposite_faces(Mesh<double> mesh) {
  for (std::size_t f = 0; f < mesh.indices.size(); f += 3) {
    std::swap(mesh.indices[f + 1], mesh.indices[f + 2]);
  }
  return mesh;
}

/// A scan by a sensor above.
Samples seen_from_above(const Mesh<double>& mesh, const std::vector<double>& vertices) {
  auto scan = scan_of(mesh, vertices);
  scan.viewpoints = {1, 2, 40};
  return scan;
}

std::vector<std::uint8_t> cloth_of(const Mesh<double>& mesh) {
  const auto component = build_topology(mesh.faces(), mesh.size()).component;
  return find_cloth(triangles_of(mesh), component, rows_of(mesh.vertices), {});
}

TEST_CASE("sheets that are free to slide are cloth, components one by one") {
  const auto sheet = flat_sheet(12);
  auto hill = flat_sheet(16);  // its shape holds it
  for (std::size_t v = 0; v < hill.vertices.size(); v += 3) {
    const double x = hill.vertices[v] / 7.5;
    const double y = hill.vertices[v + 1] / 7.5;
    hill.vertices[v + 2] =
        12 * std::cos(2 * x) * std::cos(1.5 * y + 0.4 * x) + 4 * std::sin(3 * x * y);
  }
  const auto all = join(join(sheet, bumpy_torus(16)), hill);
  std::vector<std::uint8_t> expected(all.size(), 0);
  std::fill_n(expected.begin(), sheet.size(), std::uint8_t{1});
  CHECK(cloth_of(all) == expected);
}

TEST_CASE("cloth that turns in its own plane is followed, wherever its faces look") {
  const auto sheet = flat_sheet(14);
  const auto other = with_opposite_faces(sheet);
  Tracker<double> tracker(sheet.faces(), sheet.points());
  Tracker<double> tracker_of_other(other.faces(), other.points());
  for (int t = 1; t <= 12; ++t) {
    const auto truth = translated(turned(sheet.vertices, 0.03 * t), 0.2 * t, 0.0, 0.0);
    const auto scan = seen_from_above(sheet, truth);
    const auto found = track(tracker, scan);
    CHECK(largest_difference(found, truth) < 0.7);
    CHECK(largest_difference(track(tracker_of_other, scan), found) < 1e-9);
  }
}

/// A flat sheet bent by a wave that turns it by up to an angle; no length changes.
std::vector<double> with_wave(std::vector<double> vertices, double steepest, double phase) {
  double s = vertices[0];  // along the sheet
  double x = s;
  double z = 0;
  for (std::size_t v = 0; v < vertices.size(); v += 3) {
    if (vertices[v] != s) {
      const double angle = steepest * std::sin(0.6 * (s + 0.5) + phase);
      x += std::cos(angle);
      z += std::sin(angle);
      s = vertices[v];
    }
    vertices[v] = x;
    vertices[v + 2] = z;
  }
  return vertices;
}

TEST_CASE("cloth through which a wave runs slides along itself, and is followed") {
  const auto sheet = flat_sheet(14);
  Tracker<double> tracker(sheet.faces(), sheet.points(), {.uncertainty = true});
  double within = 0;
  for (int t = 1; t <= 15; ++t) {
    const auto truth = with_wave(sheet.vertices, std::min(0.6, 0.12 * t), 0.4 * t);
    const auto tracked = track(tracker, seen_from_above(sheet, truth));
    CHECK(largest_difference(tracked, truth) < 0.6);
    const auto errors = tracker.standard_error();
    for (std::size_t v = 0; v < sheet.size(); ++v) {
      const double height = std::abs(tracked[3 * v + 2] - truth[3 * v + 2]);
      within += height <= 1.645 * errors[v] ? 1 : 0;
    }
  }
  CHECK(within / (15.0 * static_cast<double>(sheet.size())) > 0.5);
}

TEST_CASE("cloth that ends where the scan goes on is not drawn outwards") {
  const auto sheet = flat_sheet(12);
  const auto large = flat_sheet(40);
  Tracker<double> tracker(sheet.faces(), sheet.points());
  const auto scan = seen_from_above(large, large.vertices);
  for (int t = 0; t < 4; ++t) {
    CHECK(largest_difference(track(tracker, scan), sheet.vertices) < 1e-6);
  }
}

/// A flat sheet, folded by an angle around a line at x = 0, along an arc of this radius.
std::vector<double> folded(std::vector<double> vertices, double angle, double radius) {
  for (std::size_t v = 0; v < vertices.size(); v += 3) {
    const double s = vertices[v];
    const double turn = std::clamp(s / radius, 0.0, angle);
    const double rest = std::max(0.0, s - radius * angle);
    vertices[v] = std::min(s, 0.0) + radius * std::sin(turn) + rest * std::cos(angle);
    vertices[v + 2] += radius * (1 - std::cos(turn)) + rest * std::sin(angle);
  }
  return vertices;
}

/// The part of a scan with x below `end`.
Samples part_of(const Samples& scan, double end) {
  Samples part;
  for (std::size_t i = 0; i < scan.points.size(); i += 3) {
    if (!(scan.points[i] < end)) continue;
    for (std::size_t c = 0; c < 3; ++c) {
      part.points.push_back(scan.points[i + c]);
      part.normals.push_back(scan.normals[i + c]);
    }
  }
  return part;
}

TEST_CASE("cloth that folds is followed, where one side of it or the other is measured") {
  const auto sheet = flat_sheet(14);
  Tracker<double> tracker(sheet.faces(), sheet.points());
  for (int t = 1; t <= 24; ++t) {
    const auto truth = folded(sheet.vertices, 0.07 * t, 1.5);
    auto scan = scan_of(sheet, truth);
    for (std::size_t i = 0; i < scan.points.size(); i += 3) {
      if (scan.points[i] < 0 && scan.points[i + 2] < 0.5) continue;
      for (std::size_t c = 0; c < 3; ++c) scan.normals[i + c] *= -1;  // of the part that is folded
    }
    scan.viewpoints = {1, 2, 40, 1, 2, -40, 40, 2, 1};
    CHECK(largest_difference(track(tracker, scan), truth) < 0.8);
  }
}

TEST_CASE(
    "cloth seen from its edge, and cloth that leaves the picture and returns, is found again") {
  const auto sheet = flat_sheet(12);
  for (const bool leaves : {false, true}) {
    Tracker<double> tracker(sheet.faces(), sheet.points());
    for (int t = 1; t <= 12; ++t) {
      const auto truth = translated(sheet.vertices, 0.0, 0.0, 0.1 * t);
      const bool is_away = t > 3 && t < 9;
      auto scan = scan_of(sheet, truth);
      if (leaves && is_away) scan = part_of(scan, 3.0 * std::abs(t - 6) - 6);
      scan.viewpoints = {1, 2, 40};
      if (!leaves && is_away) scan.viewpoints = {40, 2, 0.1 * t};
      const auto found = track(tracker, scan);
      // It shrinks while it leaves, and needs some frames to spread again.
      const bool is_back = leaves && (t == 9 || t == 10);
      CHECK(largest_difference(found, truth) < (is_away ? 1.5 : is_back ? 0.5 : 0.3));
    }
  }
}

TEST_CASE("two sheets that come close to each other stay apart") {
  const auto sheet = flat_sheet(12);
  auto two = join(sheet, sheet);
  const auto at_height = [&](double height) {
    auto vertices = two.vertices;
    for (std::size_t v = 2; v < sheet.vertices.size(); v += 3) vertices[v] = height;
    return vertices;
  };
  two.vertices = at_height(3);
  Tracker<double> tracker(two.faces(), two.points());
  for (int t = 1; t <= 20; ++t) {
    const auto truth = at_height(std::max(0.6, 0.3 * std::abs(10 - t)));
    auto scan = scan_of(two, truth);
    const auto half = scan.normals.size() / 2;  // the lower sheet is seen from below
    for (std::size_t i = half; i < scan.normals.size(); ++i) scan.normals[i] *= -1;
    scan.viewpoints = {1, 2, 40, 1, 2, -40};
    CHECK(largest_difference(track(tracker, scan), truth) < 0.5);
  }
}

/// The energy of the membrane with mu = 1, as its equation says.
double membrane_energy(const Mesh<double>& mesh, const std::vector<double>& x) {
  const auto at = [](const std::vector<double>& points, Index v) {
    return Eigen::Vector3d(
        Eigen::Map<const Eigen::Vector3d>(&points[3 * static_cast<std::size_t>(v)]));
  };
  double energy = 0;
  for (const Triangle& face : triangles_of(mesh)) {
    Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();
    std::array<double, 3> weights{};
    std::array<Eigen::Vector3d, 3> before, now;
    for (std::size_t s = 0; s < 3; ++s) {
      const Index i = face[s];
      const Index j = face[(s + 1) % 3];
      const Eigen::Vector3d apex = at(mesh.vertices, face[(s + 2) % 3]);
      const Eigen::Vector3d a = at(mesh.vertices, i) - apex;
      const Eigen::Vector3d b = at(mesh.vertices, j) - apex;
      weights[s] = 0.5 * a.dot(b) / a.cross(b).norm();
      before[s] = at(mesh.vertices, i) - at(mesh.vertices, j);
      now[s] = at(x, i) - at(x, j);
      covariance += weights[s] * now[s] * before[s].transpose();
    }
    const Eigen::JacobiSVD<Eigen::Matrix3d> svd(covariance,
                                                Eigen::ComputeFullU | Eigen::ComputeFullV);
    const Eigen::Matrix3d rotation = svd.matrixU() * svd.matrixV().transpose();
    for (std::size_t s = 0; s < 3; ++s) {
      energy += weights[s] * (now[s] - rotation * before[s]).squaredNorm();
    }
  }
  return energy;
}

TEST_CASE("the membrane pulls down the slope of its energy, and not where cloth only folds") {
  auto mesh = flat_sheet(5);
  for (std::size_t v = 0; v < mesh.vertices.size(); v += 3) {
    mesh.vertices[v] += 0.5 * mesh.vertices[v + 1];  // acute triangles, none of which is flipped
  }
  Workers workers(1);
  Membrane membrane(triangles_of(mesh), rows_of(mesh.vertices), 1,
                    std::vector<double>(mesh.size(), 1.0), workers);
  const auto force_at = [&](const std::vector<double>& x) {
    std::vector<Vector3<double>> forces(mesh.size());
    membrane.add_forces(rows_of(x), forces);
    return forces;
  };
  auto x = turned(mesh.vertices, 0.4);
  for (const auto& force : force_at(x)) CHECK(squared_norm(force) < 1e-24);
  for (std::size_t i = 0; i < x.size(); ++i) x[i] += 0.3 * std::sin(5.0 * static_cast<double>(i));
  const auto forces = force_at(x);
  constexpr double step = 1e-5;
  for (std::size_t i = 0; i < x.size(); ++i) {
    auto above = x;
    auto below = x;
    above[i] += step;
    below[i] -= step;
    const double slope = (membrane_energy(mesh, above) - membrane_energy(mesh, below)) / (2 * step);
    const auto& force = forces[i / 3];
    const double found = i % 3 == 0 ? force.x : i % 3 == 1 ? force.y : force.z;
    CHECK(found == doctest::Approx(-0.5 * slope).epsilon(1e-4));
  }
  // Turned by a right angle around a row of edges.
  auto fold = mesh.vertices;
  for (std::size_t v = 0; v < fold.size(); v += 3) {
    if (fold[v + 1] > 0) fold[v + 2] = std::exchange(fold[v + 1], 0.0);
  }
  for (const auto& force : force_at(fold)) CHECK(squared_norm(force) < 1e-24);
}

TEST_CASE("a state holds what the next frame of cloth needs") {
  const auto sheet = flat_sheet(12);
  Tracker<double> tracker(sheet.faces(), sheet.points());
  Tracker<double> restored(sheet.faces(), sheet.points());
  for (int t = 1; t <= 4; ++t) {
    const auto scan = seen_from_above(sheet, turned(sheet.vertices, 0.03 * t));
    restored.restore(tracker.state());
    CHECK(track(restored, scan) == track(tracker, scan));
  }
}

}  // namespace
}  // namespace dynmesh::testing
