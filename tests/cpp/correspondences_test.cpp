#include "tracking/correspondences.hpp"

#include <doctest/doctest.h>

#include <cmath>
#include <vector>

#include "scans.hpp"
#include "support/geometry.hpp"
#include "support/workers.hpp"
#include "tracking/vertex_normals.hpp"

namespace dynmesh::testing {
namespace {

TEST_CASE("points beside a hidden vertex do not draw it") {
  // A small torus behind a large one, as a sensor far out on the x axis sees them.
  const Mesh<double> large = bumpy_torus(30);
  Mesh<double> small = bumpy_torus(20);
  for (std::size_t i = 0; i < small.vertices.size(); ++i) {
    small.vertices[i] = 0.1 * small.vertices[i] - (i % 3 == 0 ? 3.5 : 0);
  }
  const auto mesh = join(large, small);
  const std::size_t k = mesh.size();
  const auto faces = triangles_of(mesh);
  const auto x = rows_of(mesh.vertices);
  std::vector<Vector3<double>> normals(k);
  find_vertex_normals(faces, x, normals);

  const Topology topology = build_topology(mesh.faces(), k);
  Workers workers(1);
  const TrackingConstants constants;
  const double mean_edge = mean_edge_length<double>(topology.cells, x);
  for (const bool is_seen : {false, true}) {
    PointScan scan;
    for (std::size_t v = large.size(); v < k; ++v) {
      scan.points.push_back(x[v] + 3 * mean_edge * normals[v]);
      scan.normals.push_back(normals[v]);
    }
    scan.sensors = {{is_seen ? -60.0 : 60.0, 0, 0}};
    scan.index();
    Correspondences correspondences(faces, topology, workers, constants);
    correspondences.begin(scan, mean_edge);
    correspondences.find_visible(x);
    std::size_t n_hidden = 0;
    for (std::size_t v = large.size(); v < k; ++v) {
      n_hidden += correspondences.visible()[v] == Sight::hidden ? 1 : 0;
    }
    // A search so narrow that no vertex has a point of its own.
    const auto found = correspondences.find(x, {1, 1, 1, 1});
    const double unexplained = correspondences.draw_towards_unexplained(x, 1, 1);
    std::size_t n_drawn = 0;
    for (std::size_t v = large.size(); v < k; ++v) n_drawn += found[v].weight > 0 ? 1 : 0;
    CHECK((n_hidden == small.size()) == !is_seen);
    CHECK((n_drawn > 0) == is_seen);
    CHECK((unexplained > 0) == is_seen);
  }
}

}  // namespace
}  // namespace dynmesh::testing
