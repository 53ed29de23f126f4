/// Registration of a template with one scan.
#include <doctest/doctest.h>
#include <dynmesh/dynmesh.h>

#include <array>
#include <cstddef>
#include <cstdint>
#include <dynmesh/registration.hpp>
#include <vector>

#include "meshes.hpp"
#include "registration/candidates.hpp"
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

TEST_CASE("each tip that a result left out is tried for every tip of the template") {
  const auto mesh = bumpy_torus(12);
  const auto faces = triangles_of(mesh);
  const auto frame = rows_of(mesh.vertices);
  std::vector<Vector3<double>> x = frame;
  for (auto& position : x) position.y += 0.01;
  TipsOfBoth tips;
  tips.vertices = {3, 50, 97};
  const Vector3<double> left_out = {40, 0, 0};
  tips.positions = {frame[50], left_out, frame[3]};
  const auto found =
      candidates_by_tips_left_out({faces, frame, 1}, tips, Eigen::Isometry3d::Identity(), x, {});
  REQUIRE(found.size() == 3);
  for (std::size_t moving = 0; moving < 3; ++moving) {
    REQUIRE(found[moving].landmarks.size() == 3);
    for (std::size_t i = 0; i < 3; ++i) {
      const TemplateLandmark& landmark = found[moving].landmarks[i];
      const auto vertex = static_cast<std::size_t>(tips.vertices[i]);
      const auto& expected = i == moving ? left_out : x[vertex];
      CHECK(landmark.vertex == tips.vertices[i]);
      CHECK(squared_norm(landmark.position - expected) == 0);
      CHECK(squared_norm(landmark.start - frame[vertex]) == 0);
    }
  }
  CHECK(candidates_by_tips_left_out({faces, frame, 100}, tips, Eigen::Isometry3d::Identity(), x, {})
            .empty());
}

TEST_CASE("each two tips take each other's place") {
  const auto mesh = bumpy_torus(12);
  const auto faces = triangles_of(mesh);
  const auto frame = rows_of(mesh.vertices);
  TipsOfBoth tips;
  tips.vertices = {3, 50, 97};
  const auto found =
      candidates_by_exchanged_tips({faces, frame, 1}, tips, Eigen::Isometry3d::Identity(), frame);
  REQUIRE(found.size() == 3);
  const std::array<std::array<std::size_t, 3>, 3> expected = {
      {{50, 3, 97}, {97, 50, 3}, {3, 97, 50}}};
  for (std::size_t n = 0; n < 3; ++n) {
    REQUIRE(found[n].landmarks.size() == 3);
    for (std::size_t i = 0; i < 3; ++i) {
      CHECK(found[n].landmarks[i].vertex == tips.vertices[i]);
      CHECK(squared_norm(found[n].landmarks[i].position - frame[expected[n][i]]) == 0);
    }
  }
}

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
  CHECK(report.stretched == expected.stretched);
  CHECK(report.transform[3] == expected.transform[3]);
}

}  // namespace
}  // namespace dynmesh::testing
