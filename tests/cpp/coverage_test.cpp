/// Which part of a surface was measured.
#include "registration/coverage.hpp"

#include <doctest/doctest.h>

#include <cstddef>
#include <vector>

#include "registration/pose_measure.hpp"
#include "scans.hpp"
#include "support/workers.hpp"
#include "tracking/point_scan.hpp"
#include "tracking/vertex_normals.hpp"

namespace dynmesh::testing {
namespace {

/// Ten equal tori beside each other, and points on some of them.
struct Tori {
  static constexpr std::size_t number = 10;

  Mesh<double> torus = bumpy_torus(24);
  Mesh<double> mesh = all();
  std::vector<Triangle> faces = triangles_of(mesh);
  std::vector<Vector3<double>> frame = rows_of(mesh.vertices), x = frame, normals;
  Topology topology = build_topology(mesh.faces(), mesh.size());
  PointScan scan;

  Tori() : normals(mesh.size()) { find_vertex_normals(faces, frame, normals); }

  [[nodiscard]] Mesh<double> all() const {
    Mesh<double> found = torus;
    for (std::size_t i = 1; i < number; ++i) {
      const double distance = 50.0 * static_cast<double>(i);
      found = join(found, {translated(torus.vertices, distance, 0.0, 0.0), torus.indices});
    }
    return found;
  }
  /// Adds the vertices of the first ones as points.
  void measure(std::size_t n) {
    const auto end = static_cast<std::ptrdiff_t>(n * torus.size());
    scan.points.assign(frame.begin(), frame.begin() + end);
    scan.normals.assign(normals.begin(), normals.begin() + end);
    scan.index();
  }
  /// Moves the last torus to the first one.
  void put_last_on_first() {
    for (std::size_t v = 0; v < torus.size(); ++v) x[x.size() - torus.size() + v] = frame[v];
  }
  [[nodiscard]] Coverage found() const {
    const std::vector<Sight> seen(x.size(), Sight::front);
    return coverage_of({faces, topology.cells, frame, x, normals, seen,
                        mean_edge_length<double>(topology.cells, frame)},
                       scan, {}, {});
  }
  [[nodiscard]] RegistrationQuality quality() const {
    const Targets targets;
    const RegistrationConstants constants;
    Workers workers{1};
    Pose pose;
    pose.x = x;
    PoseMeasure(faces, topology, frame, targets, workers, constants).measure(scan, pose);
    return pose.quality;
  }
};

TEST_CASE("what has no points is as large as its largest piece") {
  Tori tori;
  tori.measure(Tori::number);
  CHECK(tori.found().hole == 0);
  CHECK(tori.quality() == RegistrationQuality::good);
  tori.measure(Tori::number - 1);
  CHECK(tori.found().hole == doctest::Approx(0.1));
  CHECK(tori.quality() == RegistrationQuality::doubtful);
  tori.measure(1);
  CHECK(tori.found().empty_share == doctest::Approx(0.9));
  CHECK(tori.found().hole == doctest::Approx(0.1));
  CHECK(tori.found().overlap == 0);
}

TEST_CASE("parts that lie on the same points overlap unless they face opposite ways") {
  Tori tori;
  tori.measure(Tori::number - 1);
  tori.put_last_on_first();
  CHECK(tori.found().hole == 0);
  CHECK(tori.found().overlap == doctest::Approx(0.2));
  CHECK(tori.quality() == RegistrationQuality::doubtful);
  for (std::size_t v = 0; v < tori.torus.size(); ++v) tori.normals[v] = -1.0 * tori.normals[v];
  CHECK(tori.found().overlap < 0.01);
}

}  // namespace
}  // namespace dynmesh::testing
