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
#include "shared_work.hpp"
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

TEST_CASE("with training and errors, the result does not depend on the number of threads") {
  const SharedWork shared;
  const auto mesh = as_floats(bumpy_torus(16));
  const auto training = training_of(training_frames_of(mesh.vertices, 4));
  Tracker<float> one(mesh.faces(), mesh.points(), {.uncertainty = true}, training);
  Tracker<float> three(mesh.faces(), mesh.points(), {.threads = 3, .uncertainty = true}, training);
  const auto shape = bumpy_torus(16);
  for (int n = 1; n < 5; ++n) {
    const auto scan = scan_of(shape, at(shape, n));
    std::vector<float> found;
    CHECK(shared_pieces([&] { found = track(three, scan); }) > 0);
    CHECK(found == track(one, scan));
    CHECK(bars(one) == bars(three));
  }
  CHECK(one.report().stages.prior_weight > 0);
}

TEST_CASE("a training sequence of a tracker is checked as that of a completer") {
  const auto mesh = bumpy_torus(10);
  const auto shown = training_frames_of(mesh.vertices, 3);
  const auto refused = [&](const Training<double>& training) {
    return message_of(
        [&] { const Tracker<double> tracker(mesh.faces(), mesh.points(), {}, training); });
  };
  Training<double> two(mesh.size());
  for (int n = 0; n < 2; ++n) two.add({shown[0].data(), mesh.size()});
  CHECK(refused(two) == "training: has 2 frames, but at least 3 are needed");
  CHECK(refused(Training<double>(7)).starts_with("training: its frames have 7 vertices"));
  auto large = shown;
  for (auto& frame : large) {
    for (double& x : frame) x *= 1000;
  }
  CHECK(refused(training_of(large)).starts_with("training: its size"));
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
