/// What speaks for a surface in a scan, and what against it.
#include "quality/evidence.hpp"

#include <doctest/doctest.h>

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <random>
#include <vector>

#include "base/geometry.hpp"
#include "base/statistics.hpp"
#include "meshes.hpp"
#include "scans.hpp"
#include "surface_fit/surface_level.hpp"

namespace dynmesh::testing {
namespace {

/// A mesh that lies in a scan of itself, until either is changed.
struct Scene {
  explicit Scene(Mesh<double> given = bumpy_torus(24)) : mesh(std::move(given)) {
    const Samples samples = scan_of(mesh, mesh.vertices);
    scan.points = rows_of(samples.points);
    scan.normals = rows_of(samples.normals);
    for (Vector3& normal : scan.normals) normal = unit_of(normal);
  }

  /// Leaves the points that face a sensor, which it is told of.
  void see_from(const Vector3& sensor) {
    PointScan seen;
    seen.sensors = {sensor};
    for (std::size_t i = 0; i < scan.size(); ++i) {
      if (!(dot(scan.normals[i], unit_of(sensor - scan.points[i])) > 0.2)) continue;
      seen.points.push_back(scan.points[i]);
      seen.normals.push_back(scan.normals[i]);
    }
    scan = std::move(seen);
  }
  void add_noise(double size) {
    std::mt19937 generator(1);
    std::normal_distribution<double> number;
    for (std::size_t i = 0; i < scan.size(); ++i) {
      scan.points[i] = scan.points[i] + size * number(generator) * scan.normals[i];
    }
  }
  [[nodiscard]] double mean_edge() const {
    return mean_edge_length(build_topology(mesh.faces(), mesh.size()).cells,
                            rows_of(mesh.vertices));
  }
  [[nodiscard]] Evidence found() const {
    const Topology topology = build_topology(mesh.faces(), mesh.size());
    const auto faces = triangles_of(mesh);
    const auto frame = rows_of(mesh.vertices);
    Workers workers(1);
    SurfaceLevel level(faces, topology, workers, frame);
    const FittedSurface fitted = level.agreement_with(scan, x);
    std::vector<std::uint8_t> is_sheet;
    for (const Index of : topology.component) {
      is_sheet.push_back(level.materials()[at(of)].is_sheet ? 1 : 0);
    }
    const BentSurface surface = {
        faces,    topology,          frame,         fitted.x, fitted.normals,
        is_sheet, level.mean_edge(), size_of(frame)};
    return evidence_of(surface, fitted.points, {8 * level.mean_edge()}, workers);
  }

  Mesh<double> mesh;
  std::vector<Vector3> x = rows_of(mesh.vertices);
  PointScan scan;
};

TEST_CASE("a surface that lies in its scan is explained, whatever else was measured") {
  for (const bool has_others : {false, true}) {
    CAPTURE(has_others);
    Scene scene;
    if (has_others) {
      for (std::size_t i = 0, n = scene.scan.size(); i < n; ++i) {
        scene.scan.points.push_back(scene.scan.points[i] + Vector3{0, 40, 0});
        scene.scan.normals.push_back(scene.scan.normals[i]);
      }
    }
    const Evidence found = scene.found();
    CHECK(found.explained > 0.99);
    CHECK(found.contradicted() == 0);
    CHECK(found.points.has_normals);
    CHECK(found.points.noise < 0.02 * scene.mean_edge());
    CHECK(found.others == doctest::Approx(has_others ? 0.5 : 0));
    if (has_others) CHECK(std::abs(found.others_distance - 40) < 6);
  }
}

TEST_CASE("what a sensor cannot see needs no points, and elsewhere they are missing") {
  Scene scene;
  scene.see_from({0, 0, 40});
  const Evidence right = scene.found();
  CHECK(right.seen < 0.6);
  CHECK(right.explained > 0.98);
  CHECK(right.contradicted() < 0.01);
  PointScan half;
  half.sensors = scene.scan.sensors;
  for (std::size_t i = 0; i < scene.scan.size(); ++i) {
    if (scene.scan.points[i].x < 0) continue;
    half.points.push_back(scene.scan.points[i]);
    half.normals.push_back(scene.scan.normals[i]);
  }
  scene.scan = std::move(half);
  const Evidence missing = scene.found();
  CHECK(missing.explained == doctest::Approx(0.5).epsilon(0.1));
  CHECK(missing.hole > 0.15);
  CHECK(missing.seen_through == 0);
}

TEST_CASE("a sheet that is too flat to its sensor is judged by the points on it") {
  // A flat sheet, seen from its plane, and a sliver at its edge that is bent towards the sensor.
  for (const bool has_sliver : {false, true}) {
    for (const double beside : {0.0, 5.0}) {
      CAPTURE(has_sliver);
      CAPTURE(beside);
      Mesh<double> flat = sheet<double>(30);
      for (std::size_t v = 0; v < flat.size(); ++v) {
        flat.vertices[3 * v + 2] = has_sliver && v < 30 ? 1.5 : 0;
      }
      Scene scene(std::move(flat));
      PointScan& scan = scene.scan;
      scan.sensors = {{15, -200, 1}};
      // Of the sliver, nothing was measured; of other things, as much as of the sheet.
      PointScan shown;
      shown.sensors = scan.sensors;
      for (std::size_t i = 0; i < scan.size(); ++i) {
        if (scan.points[i].z > 0.01) continue;
        shown.points.push_back(scan.points[i] + Vector3{0, 0, beside});
        shown.points.push_back(scan.points[i] + Vector3{0, 0, 40});
        shown.normals.insert(shown.normals.end(), 2, scan.normals[i]);
      }
      scan = std::move(shown);
      const Evidence found = scene.found();
      CHECK((found.explained > 0.99) == (beside == 0));
    }
  }
}

TEST_CASE("what lies before measured points was seen through") {
  // A sheet, and a smaller one before it that is either measured or not.
  const auto wall = sheet<double>(30);
  const auto before = sheet<double>(10);
  Mesh<double> both = join(wall, {translated(before.vertices, 8.0, 8.0, 12.0), before.indices});
  Scene scene(both);
  for (const bool is_there : {true, false}) {
    CAPTURE(is_there);
    Scene shown(is_there ? both : wall);
    scene.scan = std::move(shown.scan);
    for (Vector3& normal : scene.scan.normals) normal = normal.z < 0 ? -1.0 * normal : normal;
    scene.scan.sensors = {{15, 15, 60}};
    const Evidence found = scene.found();
    CHECK((found.seen_through > 0.05) == !is_there);
    CHECK((found.explained > 0.98) == is_there);
  }
}

TEST_CASE("the noise is what neighbouring points do not share") {
  for (const double noise : {0.0, 0.1, 0.4}) {
    for (const double beside : {0.0, 0.3}) {
      CAPTURE(noise);
      CAPTURE(beside);
      Scene scene(bumpy_torus(40));
      const double edge = scene.mean_edge();
      scene.add_noise(noise * edge);
      for (Vector3& x : scene.x) x = x + Vector3{0, 0, beside * edge};
      const double found = scene.found().points.noise / edge;
      CHECK(std::abs(found - noise) < 0.03 + 0.2 * noise);
    }
  }
}

TEST_CASE("normals tell the side of a surface if those of neighbours agree") {
  Scene scene;
  for (Vector3& normal : scene.scan.normals) normal = -1.0 * normal;
  CHECK(scene.found().wrong_side > 0.99);
  CHECK(scene.found().explained < 0.01);
  std::mt19937 generator(1);
  std::normal_distribution<double> number;
  for (Vector3& normal : scene.scan.normals) {
    normal = unit_of({number(generator), number(generator), number(generator)});
  }
  CHECK_FALSE(scene.found().points.has_normals);
  CHECK(scene.found().wrong_side == 0);
  CHECK(scene.found().explained > 0.99);
}

}  // namespace
}  // namespace dynmesh::testing
