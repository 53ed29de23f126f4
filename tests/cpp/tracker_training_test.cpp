#include <doctest/doctest.h>
#include <dynmesh/dynmesh.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <dynmesh/tracker.hpp>
#include <string>
#include <vector>

#include "meshes.hpp"
#include "scans.hpp"
#include "training_data.hpp"

namespace dynmesh::testing {
namespace {

/// The torus while it moves as in training frames of it.
std::vector<double> at(const Mesh<double>& mesh, int n) { return bent(mesh.vertices, 0.4 * n); }

template <class Real>
std::vector<Real> bars(const Tracker<Real>& tracker) {
  const auto values = tracker.standard_error();
  return {values.begin(), values.end()};
}

TEST_CASE("the C interface trains on and measures errors as the C++ interface does") {
  const auto mesh = bumpy_torus(16);
  const auto k = static_cast<std::int64_t>(mesh.size());
  const auto shown = training_frames_of(mesh.vertices, 4);
  Tracker<double> expected(mesh.faces(), mesh.points(), {.uncertainty = true}, training_of(shown));
  const auto n_faces = static_cast<std::int64_t>(mesh.faces().count);
  const dynmesh_points first = {mesh.vertices.data(), k, 3, 1, DYNMESH_FLOAT64};
  dynmesh_training* training = nullptr;
  REQUIRE(dynmesh_training_create(k, DYNMESH_FLOAT64, &training) == DYNMESH_OK);
  dynmesh_tracker* tracker = nullptr;
  CHECK(dynmesh_tracker_create_with(mesh.indices.data(), n_faces, &first, 1, 1, 0, training,
                                    &tracker) == DYNMESH_INVALID_ARGUMENT);
  CHECK(tracker == nullptr);
  CHECK(std::string(dynmesh_last_message()).starts_with("training: has 0 frames"));
  for (const auto& frame : shown) {
    const dynmesh_points rows = {frame.data(), k, 3, 1, DYNMESH_FLOAT64};
    REQUIRE(dynmesh_training_add(training, &rows) == DYNMESH_OK);
  }
  REQUIRE(dynmesh_tracker_create_with(mesh.indices.data(), n_faces, &first, 1, 1, 0, training,
                                      &tracker) == DYNMESH_OK);
  dynmesh_training_destroy(training);
  std::vector<double> found(3 * mesh.size());
  const dynmesh_output out = {found.data(), k, 3, 1, DYNMESH_FLOAT64};
  for (int n = 1; n < 5; ++n) {
    const auto scan = scan_of(mesh, at(mesh, n));
    const auto rows = static_cast<std::int64_t>(scan.points.size() / 3);
    const dynmesh_points points = {scan.points.data(), rows, 3, 1, DYNMESH_FLOAT64};
    const dynmesh_points normals = {scan.normals.data(), rows, 3, 1, DYNMESH_FLOAT64};
    REQUIRE(dynmesh_tracker_push(tracker, &points, &normals, nullptr, &out, nullptr) == DYNMESH_OK);
    CHECK(found == track(expected, scan));
  }
  CHECK(expected.report().stages.prior_weight > 0);
  std::vector<double> errors(mesh.size());
  REQUIRE(dynmesh_tracker_standard_error(tracker, errors.data(), k, DYNMESH_FLOAT64) == DYNMESH_OK);
  CHECK(errors == bars(expected));
  CHECK(dynmesh_tracker_standard_error(tracker, errors.data(), k, DYNMESH_FLOAT32) ==
        DYNMESH_INVALID_ARGUMENT);
  CHECK(dynmesh_tracker_standard_error(tracker, errors.data(), k - 1, DYNMESH_FLOAT64) ==
        DYNMESH_INVALID_ARGUMENT);
  dynmesh_tracker_destroy(tracker);
}

}  // namespace
}  // namespace dynmesh::testing
