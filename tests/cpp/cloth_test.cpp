#include "tracking/cloth.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <dynmesh/tracker.hpp>
#include <vector>

#include "meshes.hpp"
#include "scans.hpp"

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

std::vector<std::uint8_t> cloth_of(const Mesh<double>& mesh) {
  std::vector<Triangle> faces(mesh.faces().count);
  for (std::size_t f = 0; f < faces.size(); ++f) faces[f] = mesh.faces()[f];
  std::vector<Vector3<double>> x(mesh.size());
  for (std::size_t v = 0; v < x.size(); ++v) {
    x[v] = {mesh.vertices[3 * v], mesh.vertices[3 * v + 1], mesh.vertices[3 * v + 2]};
  }
  return find_cloth(faces, build_topology(mesh.faces(), x.size()).component, x, {});
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
    auto scan = scan_of(sheet, truth);
    scan.viewpoints = {1, 2, 40};
    const auto found = track(tracker, scan);
    CHECK(largest_difference(found, truth) < 0.7);
    CHECK(largest_difference(track(tracker_of_other, scan), found) < 1e-9);
  }
}

TEST_CASE("cloth that ends where the scan goes on is not drawn outwards") {
  const auto sheet = flat_sheet(12);
  const auto large = flat_sheet(40);
  Tracker<double> tracker(sheet.faces(), sheet.points());
  auto scan = scan_of(large, large.vertices);
  scan.viewpoints = {1, 2, 40};
  for (int t = 0; t < 4; ++t) {
    CHECK(largest_difference(track(tracker, scan), sheet.vertices) < 1e-6);
  }
}

TEST_CASE("a state holds what the next frame of cloth needs") {
  const auto sheet = flat_sheet(12);
  Tracker<double> tracker(sheet.faces(), sheet.points());
  Tracker<double> restored(sheet.faces(), sheet.points());
  for (int t = 1; t <= 4; ++t) {
    auto scan = scan_of(sheet, turned(sheet.vertices, 0.03 * t));
    scan.viewpoints = {1, 2, 40};
    restored.restore(tracker.state());
    CHECK(track(restored, scan) == track(tracker, scan));
  }
}

}  // namespace
}  // namespace dynmesh::testing
