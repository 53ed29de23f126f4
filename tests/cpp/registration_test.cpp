/// Registration of a template with one scan.
#include <doctest/doctest.h>
#include <dynmesh/dynmesh.h>

#include <cstddef>
#include <cstdint>
#include <dynmesh/registration.hpp>
#include <vector>

#include "meshes.hpp"
#include "scans.hpp"

namespace dynmesh::testing {
namespace {

using Rows = std::vector<double>;

Scan<double> viewed(const Samples& samples) {
  const std::size_t n = samples.points.size() / 3;
  return {{samples.points.data(), n}, {samples.normals.data(), n}};
}

/// A torus that stands elsewhere, and its scan.
struct Pair {
  Mesh<double> mesh = bumpy_torus(24);
  Rows truth = translated(turned(mesh.vertices, 2.0), 30.0, -14.0, 5.0);
  Samples scan = scan_of(mesh, truth);
};

TEST_CASE("C registers as C++ does") {
  const Pair pair;
  const auto expected = register_template<double>(pair.mesh.faces(), pair.mesh.points(),
                                                  viewed(pair.scan), {}, {.uncertainty = true});
  const auto k = static_cast<std::int64_t>(pair.mesh.size());
  const auto n = static_cast<std::int64_t>(pair.scan.points.size() / 3);
  const dynmesh_points positions = {pair.mesh.vertices.data(), k, 3, 1, DYNMESH_FLOAT64};
  const dynmesh_points points = {pair.scan.points.data(), n, 3, 1, DYNMESH_FLOAT64};
  const dynmesh_points normals = {pair.scan.normals.data(), n, 3, 1, DYNMESH_FLOAT64};
  dynmesh_registration_request request{};
  request.faces = pair.mesh.indices.data();
  request.n_faces = static_cast<std::int64_t>(pair.mesh.indices.size() / 3);
  request.positions = &positions;
  request.points = &points;
  request.normals = &normals;
  request.align = 1;
  request.threads = 1;
  Rows vertices(pair.truth.size());
  const dynmesh_output out = {vertices.data(), k, 3, 1, DYNMESH_FLOAT64};
  std::vector<std::uint8_t> observed(pair.mesh.size());
  Rows errors(pair.mesh.size());
  dynmesh_registration_report report{};
  REQUIRE(dynmesh_register(&request, &out, observed.data(), errors.data(), &report) == DYNMESH_OK);
  CHECK(vertices == expected.vertices);
  CHECK(observed == expected.observed);
  CHECK(errors == expected.standard_error);
  CHECK(report.quality == DYNMESH_REGISTRATION_GOOD);
  CHECK(report.distance == expected.distance);
  CHECK(report.hole == expected.hole);
  CHECK(report.unexplained == expected.unexplained);
  CHECK(report.stretch == expected.stretch);
  CHECK(report.transform[3] == expected.transform[3]);
}

}  // namespace
}  // namespace dynmesh::testing
