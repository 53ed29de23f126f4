#include "completer/outliers.hpp"

#include <doctest/doctest.h>

#include <algorithm>

#include "meshes.hpp"

namespace dynmesh::testing {
namespace {

TEST_CASE("only anchors that move away from their neighbours are rejected") {
  const auto mesh = sheet<double>(20);
  const Topology topology = build_topology(mesh.faces(), mesh.size());
  const auto previous = rows_of(mesh.vertices);
  Outliers<double> outliers(topology.cells);
  outliers.reset(previous);
  for (const double share : {0.05, 0.3, 1.0}) {
    auto known = random_mask(mesh.size(), share, 3);
    auto points = rows_of(turned(mesh.vertices, 0.2));
    CHECK(outliers.drop(previous, points, known) == 0);

    auto expected = known;
    const std::vector<std::size_t> far_away = {0, 57, 210, 399};
    for (const std::size_t v : far_away) {
      points[v] = points[v] + Vector3<double>{0, 6, -8};
      known[v] = 1;
      expected[v] = 0;
    }
    CHECK(outliers.drop(previous, points, known) == far_away.size());
    CHECK(known == expected);
  }
}

TEST_CASE("a limb that starts to move on a body at rest is not rejected, in any unit") {
  for (const double unit : {1.0, 1e6}) {
    auto mesh = sheet<double>(20);
    for (double& x : mesh.vertices) x *= unit;
    const Topology topology = build_topology(mesh.faces(), mesh.size());
    const auto previous = rows_of(mesh.vertices);
    auto points = previous;
    for (std::size_t v = 0; v < 100; ++v) {  // the first five rows, the farther the more
      points[v].z += 4e-4 * unit * static_cast<double>(5 - v / 20);
    }
    points[210].z += 4e-3 * unit;  // and one vertex alone, which may be noise
    Outliers<double> outliers(topology.cells);
    outliers.reset(previous);
    std::vector<std::uint8_t> known(mesh.size(), 1);
    CHECK(outliers.drop(previous, points, known) == 0);
  }
}

TEST_CASE("with few anchors, none is rejected") {
  const auto mesh = sheet<double>(5);
  const Topology topology = build_topology(mesh.faces(), mesh.size());
  const auto previous = rows_of(mesh.vertices);
  auto points = previous;
  points[3].x = 100;
  Outliers<double> outliers(topology.cells);
  outliers.reset(previous);
  auto known = mask(mesh.size(), {3, 10, 20});
  CHECK(outliers.drop(previous, points, known) == 0);
  known[21] = 1;
  CHECK(outliers.drop(previous, points, known) == 1);
  CHECK(known[3] == 0);
}

}  // namespace
}  // namespace dynmesh::testing
