#include "motion/motion.hpp"

#include <doctest/doctest.h>

#include "meshes.hpp"

namespace dynmesh::testing {
namespace {

/// A strip of triangles along x: vertices 0 1 2 3 ..., each connected to the next two.
struct Strip {
  std::vector<Index> indices;
  Topology topology;
  std::vector<Vector3<double>> previous;

  explicit Strip(std::vector<double> x) {
    for (Index v = 0; v + 2 < static_cast<Index>(x.size()); ++v) {
      for (const Index corner : {v, v + 1, v + 2}) indices.push_back(corner);
    }
    topology = build_topology(faces_of(indices), x.size());
    for (const double value : x) previous.push_back({value, 0, 0});
  }

  std::vector<Vector3<double>> estimate(const std::vector<std::uint8_t>& known,
                                        std::vector<Vector3<double>> points, bool revisit,
                                        Index extra_iterations = 0) {
    Generations generations(previous.size());
    Motion<double> motion(topology.cells, revisit, extra_iterations);
    motion.reset(previous);
    motion.estimate(previous, points, known, generations);
    return points;
  }
};

TEST_CASE(
    "a satellite moves by the mean motion of its anchors, weighted by inverse squared distance") {
  Strip strip({0, 1, 3});  // vertex 1 has distance 1 from vertex 0 and 2 from vertex 2
  auto points = strip.previous;
  points[0].y = 10;
  points[2].y = 5;
  const auto completed = strip.estimate(mask(3, {0, 2}), points, true);
  CHECK(completed[1].x == 1);
  CHECK(completed[1].y == doctest::Approx((10 + 0.25 * 5) / 1.25));
}

TEST_CASE("two generations, computed by hand") {
  // Cells: 0 {1 2}, 1 {0 2 3}, 2 {0 1 3}, 3 {1 2}; vertex 0 is the anchor.
  Strip strip({0, 1, 2, 4});
  auto points = strip.previous;
  points[0].z = 8;
  // Every estimate is a mean of motions of 8.
  for (const bool revisit : {true, false}) {
    const auto completed = strip.estimate(mask(4, {0}), points, revisit);
    for (const auto& v : completed) CHECK(v.z == doctest::Approx(8));
  }

  // The anchors of a longer strip are 0, which moves by 8, and 4, which does not move. Vertices 1,
  // 2 and 3 are next to an anchor, so one iteration suffices; an extra one averages its results.
  Strip longer({0, 1, 2, 3, 4});
  auto moved = longer.previous;
  moved[0].z = 8;
  const auto known = mask(5, {0, 4});
  const auto once = longer.estimate(known, moved, true);
  CHECK(once[1].z == doctest::Approx(8));  // anchor 0 alone in its cell
  CHECK(once[2].z == doctest::Approx(8.0 * 0.25 / (0.25 + 0.25)));
  CHECK(once[3].z == doctest::Approx(0));
  const auto twice = longer.estimate(known, moved, true, 1);
  // t = 2: anchors have weight 2, satellites 1. Vertex 1 has anchor 0 and vertex 2 at distance 1,
  // and vertex 3 at distance 2.
  CHECK(twice[1].z == doctest::Approx((2 * 8 + 1 * 4 + 0.25 * 0) / (2 + 1 + 0.25)));
  // Vertex 2 has anchors 0 and 4 at distance 2, and vertices 1 and 3 at distance 1.
  CHECK(twice[2].z == doctest::Approx((2 * 0.25 * 8 + 1 * 8) / (2 * 0.5 + 2)));
  const auto unchanged = longer.estimate(known, moved, false, 1);
  CHECK(unchanged[1].z == once[1].z);
}

TEST_CASE("coincident vertices stay finite and move together") {
  Strip strip({0, 0, 5, 9});
  auto points = strip.previous;
  points[0].y = 3;
  points[3].y = 1;
  const auto completed = strip.estimate(mask(4, {0, 3}), points, true);
  CHECK(completed[1].y == doctest::Approx(3));
}

TEST_CASE("a distant vertex stays finite in single precision") {
  const auto mesh = sheet<float>(4);
  const Topology topology = build_topology(mesh.faces(), mesh.size());
  std::vector<Vector3<float>> previous(mesh.size());
  for (std::size_t v = 0; v < mesh.size(); ++v) {
    previous[v] = {mesh.vertices[3 * v], mesh.vertices[3 * v + 1], mesh.vertices[3 * v + 2]};
  }
  Motion<float> motion(topology.cells, true, 0);
  motion.reset(previous);
  previous[0] = {1e30F, 0, 0};
  auto points = previous;
  Generations generations(mesh.size());
  motion.estimate(previous, points, mask(mesh.size(), {1, 4}), generations);
  for (const auto& p : points) CHECK(std::isfinite(p.x + p.y + p.z));
}

}  // namespace
}  // namespace dynmesh::testing
