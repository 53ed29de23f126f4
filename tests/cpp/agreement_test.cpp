/// How well a surface explains what was measured of it.
#include "tracking/agreement.hpp"

#include <doctest/doctest.h>

#include <cmath>
#include <cstddef>
#include <random>
#include <vector>

#include "scans.hpp"
#include "support/geometry.hpp"
#include "support/workers.hpp"
#include "tracking/point_scan.hpp"
#include "tracking/surface_places.hpp"
#include "tracking/vertex_normals.hpp"

namespace dynmesh::testing {
namespace {

/// A torus, and points at a distance above the middles of its faces.
struct Above {
  Mesh<double> mesh = bumpy_torus(24);
  std::vector<Triangle> faces = triangles_of(mesh);
  std::vector<Vector3<double>> x = rows_of(mesh.vertices), normals;
  Topology topology = build_topology(mesh.faces(), mesh.size());
  TrackingConstants constants;
  PointScan scan;

  Above() : normals(mesh.size()) { find_vertex_normals(faces, x, normals); }

  void add(std::size_t f, double height, double sign = 1) {
    const auto corner = [&](std::size_t c) { return x[static_cast<std::size_t>(faces[f][c])]; };
    const auto normal = cross(corner(1) - corner(0), corner(2) - corner(0));
    const auto unit = (1 / std::sqrt(squared_norm(normal))) * normal;
    scan.points.push_back((1.0 / 3) * (corner(0) + corner(1) + corner(2)) + height * unit);
    scan.normals.push_back(sign * unit);
  }

  [[nodiscard]] Agreements compare() {
    scan.index();
    const auto edge = mean_edge_length<double>(topology.cells, x);
    SurfacePlaces places(faces, x);
    places.follow(x);
    std::vector<Place> nearest;
    for (const auto& point : scan.points) {
      nearest.push_back(places.nearest(x, point, {}, [](const Place&) { return true; }));
    }
    return dynmesh::compare(scan, nearest, normals, std::vector<std::uint8_t>(x.size()), edge,
                            constants);
  }
};

TEST_CASE("distances from a surface are those that points were given") {
  Above above;
  const double edge = mean_edge_length<double>(above.topology.cells, above.x);
  for (std::size_t f = 0; f < 600; ++f) above.add(f, 0.02 * edge, f < 60 ? -1 : 1);
  for (std::size_t f = 600; f < 800; ++f) above.add(f, 1.3 * edge);
  const auto found = above.compare().all;
  // Where faces are large, some of the points are so sparse that they count as stray.
  CHECK(found.points > 790);
  CHECK(found.far_share == doctest::Approx(0.25).epsilon(0.02));
  CHECK(found.disagreeing == doctest::Approx(0.075).epsilon(0.02));
  CHECK(found.distance == doctest::Approx(0.02 * edge));
}

TEST_CASE("outliers do not count, but a part that the surface lacks does") {
  Above above;
  const double edge = mean_edge_length<double>(above.topology.cells, above.x);
  for (std::size_t f = 0; f < 900; ++f) above.add(f, 0.02 * edge);
  std::mt19937 random(7);
  std::normal_distribution<double> anywhere(0, 8 * edge);
  for (std::size_t i = 0; i < 45; ++i) {
    Vector3<double>& outlier = above.scan.points[20 * i];
    outlier = outlier + Vector3<double>{anywhere(random), anywhere(random), anywhere(random)};
  }
  const auto without = above.compare().all;
  CHECK(without.points < 880);
  CHECK(without.far_share < 0.02);
  CHECK(without.distance < 0.2 * edge);
  for (std::size_t f = 900; f < 1000; ++f) above.add(f, 3 * edge);
  CHECK(above.compare().all.far_share == doctest::Approx(0.1).epsilon(0.2));
}

TEST_CASE("without points nothing is said") {
  const auto found = Above().compare();
  CHECK(found.all.points == 0);
  CHECK(std::isnan(found.all.far_share));
  CHECK(std::isnan(found.all.disagreeing));
  CHECK(std::isnan(found.all.distance));
  CHECK(found.of_sensors.empty());
}

TEST_CASE("a tracker says which camera is elsewhere") {
  const auto mesh = bumpy_torus(24);
  Tracker<double> tracker(mesh.faces(), mesh.points());
  auto images = images_of(mesh, mesh.vertices, 4, 96);
  images[2].pose[11] += 2.5 * mean_edge(mesh);
  std::fill(images[3].pixels.begin(), images[3].pixels.end(), 0.0F);
  std::vector<DepthImage> views;
  for (const auto& image : images) views.push_back(image.view());
  std::vector<double> tracked(3 * mesh.size());
  const auto report = tracker.push_depth(views, {tracked.data(), mesh.size()});
  const auto sensors = tracker.agreement_of_sensors();
  REQUIRE(sensors.size() == 4);
  CHECK(sensors[2].far_share > 3 * sensors[0].far_share);
  CHECK(sensors[2].far_share > 3 * sensors[1].far_share);
  CHECK(sensors[3].points == 0);
  CHECK(std::isnan(sensors[3].far_share));
  std::size_t points = 0;
  double far = 0;
  for (std::size_t i = 0; i < 3; ++i) {
    points += sensors[i].points;
    far += sensors[i].far_share * static_cast<double>(sensors[i].points);
  }
  CHECK(points == report.agreement.points);
  CHECK(far == doctest::Approx(report.agreement.far_share * static_cast<double>(points)));
  tracker.skip({tracked.data(), mesh.size()});
  CHECK(tracker.agreement_of_sensors().empty());
  CHECK(std::isnan(tracker.report().agreement.far_share));
}

TEST_CASE("a point of a scan counts for the viewpoint that its normal turns to") {
  PointScan scan;
  scan.points = {{0, 0, 1}, {0, 0, -1}, {0.1, 0, -1}};
  scan.normals = {{0, 0, 1}, {0.1, 0, -0.99}, {0, 0.1, 0.99}};
  scan.undecided = {0, 0, 1};
  scan.sensors = {{1, 0, 9}, {0, 1, -9}};
  CHECK(scan.sensor_of(0) == 0);
  CHECK(scan.sensor_of(1) == 1);
  CHECK(scan.sensor_of(2) == 0);
  scan.normals[2] = {0, 0.1, -0.99};
  CHECK(scan.sensor_of(2) == 1);
}

}  // namespace
}  // namespace dynmesh::testing
