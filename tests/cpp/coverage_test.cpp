/// Which part of a surface was measured.
#include "quality/coverage.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "base/geometry.hpp"
#include "base/statistics.hpp"
#include "meshes.hpp"
#include "scans.hpp"
#include "surface_fit/surface_places.hpp"

namespace dynmesh::testing {
namespace {

/// Ten equal tori beside each other, and points on some of them.
struct Tori {
  static constexpr std::size_t number = 10;

  Mesh<double> torus = bumpy_torus(24);
  Mesh<double> mesh = all();
  std::vector<Triangle> faces = triangles_of(mesh);
  std::vector<Vector3> frame = rows_of(mesh.vertices), x = frame;
  std::vector<Vector3> normals = vertex_normals(faces, frame);
  Topology topology = build_topology(mesh.faces(), mesh.size());
  PointScan scan;

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
    scan = {};
    scan.points.assign(frame.begin(), frame.begin() + end);
    scan.normals.assign(normals.begin(), normals.begin() + end);
  }
  /// Moves the last torus to the first one.
  void put_last_on_first() {
    for (std::size_t v = 0; v < torus.size(); ++v) x[x.size() - torus.size() + v] = frame[v];
  }
  [[nodiscard]] Coverage found() const {
    const std::vector<std::uint8_t> is_sheet(x.size());
    return coverage_of({faces, topology, frame, x, normals, is_sheet,
                        mean_edge_length(topology.cells, frame), size_of(frame)},
                       scan);
  }
};

TEST_CASE("what has no points is as large as its largest piece") {
  Tori tori;
  tori.measure(Tori::number);
  CHECK(tori.found().hole == 0);
  tori.measure(Tori::number - 1);
  CHECK(tori.found().hole == doctest::Approx(0.1));
  tori.measure(1);
  CHECK(tori.found().hole == doctest::Approx(0.1));
  CHECK(tori.found().overlap == 0);
}

TEST_CASE("parts that lie on the same points overlap unless they face opposite ways") {
  Tori tori;
  tori.measure(Tori::number - 1);
  tori.put_last_on_first();
  CHECK(tori.found().hole == 0);
  CHECK(tori.found().overlap == doctest::Approx(0.2));
  for (std::size_t v = 0; v < tori.torus.size(); ++v) tori.normals[v] = -1.0 * tori.normals[v];
  CHECK(tori.found().overlap < 0.01);
}

/// Squares of n by n vertices, one edge apart, around the origin of the x and y axes.
struct Squares {
  std::vector<Vector3> vertices, normals;

  void add(int n, double z, double facing) {
    for (int i = 0; i < n * n; ++i) {
      vertices.push_back({i % n - 0.5 * (n - 1), i / n - 0.5 * (n - 1), z});
      normals.push_back({0, 0, facing});
    }
  }
  /// How many of the vertices of each square are seen.
  [[nodiscard]] std::vector<std::ptrdiff_t> seen_from(const std::vector<Vector3>& viewpoints,
                                                      const std::vector<int>& sizes) const {
    const std::vector<std::uint8_t> is_sheet(vertices.size());
    const auto seen =
        find_seen({{}, Topology{}, {}, vertices, normals, is_sheet, 1.0, 1.0}, viewpoints);
    std::vector<std::ptrdiff_t> numbers;
    auto first = seen.begin();
    for (const int n : sizes) {
      numbers.push_back(std::count(first, first + n * n, 1));
      first += n * n;
    }
    return numbers;
  }
};

using Numbers = std::vector<std::ptrdiff_t>;

TEST_CASE("what lies behind something else is hidden") {
  Squares squares;
  squares.add(11, 2, 1);
  squares.add(5, -2, 1);
  for (const double distance : {20.0, 400.0}) {
    CHECK(squares.seen_from({{0, 0, distance}}, {11, 5}) == Numbers{121, 0});
  }
  CHECK(squares.seen_from({}, {11, 5}) == Numbers{121, 25});
}

TEST_CASE("a back is not seen") {
  Squares square;
  square.add(11, 0, 1);
  for (const double side : {20.0, -20.0}) {
    CHECK(square.seen_from({{0, 0, side}}, {11}) == Numbers{side > 0 ? 121 : 0});
  }
}

}  // namespace
}  // namespace dynmesh::testing
