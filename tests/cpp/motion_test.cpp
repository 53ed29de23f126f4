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
