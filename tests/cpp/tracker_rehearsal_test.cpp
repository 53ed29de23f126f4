#include <doctest/doctest.h>
#include <dynmesh/dynmesh.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <dynmesh/tracker.hpp>
#include <string>
#include <vector>

#include "meshes.hpp"
#include "rehearsed.hpp"
#include "scans.hpp"
#include "shared_work.hpp"

namespace dynmesh::testing {
namespace {

/// The torus while it moves as in a take of it.
std::vector<double> at(const Mesh<double>& mesh, int n) { return bent(mesh.vertices, 0.4 * n); }

template <class Real>
std::vector<Real> bars(const Tracker<Real>& tracker) {
  const auto values = tracker.standard_error();
  return {values.begin(), values.end()};
}

TEST_CASE("with a rehearsal and errors, the result does not depend on the number of threads") {
  const SharedWork shared;
  const auto mesh = as_floats(bumpy_torus(16));
  const auto rehearsal = rehearsal_of(take_of(mesh.vertices, 4));
  Tracker<float> one(mesh.faces(), mesh.points(), {.uncertainty = true}, rehearsal);
  Tracker<float> three(mesh.faces(), mesh.points(), {.threads = 3, .uncertainty = true}, rehearsal);
  const auto shape = bumpy_torus(16);
  for (int n = 1; n < 5; ++n) {
    const auto scan = scan_of(shape, at(shape, n));
    std::vector<float> found;
    CHECK(shared_pieces([&] { found = track(three, scan); }) > 0);
    CHECK(found == track(one, scan));
    CHECK(bars(one) == bars(three));
  }
  CHECK(one.report().stages.trust > 0);
}

TEST_CASE("standard errors do not change the frames, and 0 frames have none") {
  const auto mesh = bumpy_torus(16);
  Tracker<double> with(mesh.faces(), mesh.points(), {.uncertainty = true});
  Tracker<double> without(mesh.faces(), mesh.points());
  CHECK(std::ranges::all_of(bars(with), [](double x) { return x == 0; }));
  for (int n = 1; n < 4; ++n) {
    const auto scan = scan_of(mesh, at(mesh, n));
    CHECK(track(with, scan) == track(without, scan));
    CHECK(std::ranges::all_of(bars(with), [](double x) { return x > 0; }));
    CHECK(with.report().standard_error > 0);
    CHECK(without.report().standard_error == 0);
  }
  CHECK(message_of([&] { (void)without.standard_error(); }) ==
        "standard_error: requires uncertainty=True");
}

TEST_CASE("a rehearsal of a tracker is checked as that of a completer") {
  const auto mesh = bumpy_torus(10);
  const auto take = take_of(mesh.vertices, 3);
  const auto refused = [&](const Rehearsal<double>& rehearsal) {
    return message_of(
        [&] { const Tracker<double> tracker(mesh.faces(), mesh.points(), {}, rehearsal); });
  };
  Rehearsal<double> two(mesh.size());
  for (int n = 0; n < 2; ++n) two.add({take[0].data(), mesh.size()});
  CHECK(refused(two) == "rehearsal: has 2 frames, but at least 3 are needed");
  CHECK(refused(Rehearsal<double>(7)).starts_with("rehearsal: its frames have 7 vertices"));
  auto large = take;
  for (auto& frame : large) {
    for (double& x : frame) x *= 1000;
  }
  CHECK(refused(rehearsal_of(large)).starts_with("rehearsal: its size"));
}

TEST_CASE("the C interface rehearses and measures errors as the C++ interface does") {
  const auto mesh = bumpy_torus(16);
  const auto k = static_cast<std::int64_t>(mesh.size());
  const auto take = take_of(mesh.vertices, 4);
  Tracker<double> expected(mesh.faces(), mesh.points(), {.uncertainty = true}, rehearsal_of(take));
  const auto n_faces = static_cast<std::int64_t>(mesh.faces().count);
  const dynmesh_points first = {mesh.vertices.data(), k, 3, 1, DYNMESH_FLOAT64};
  dynmesh_rehearsal* rehearsal = nullptr;
  REQUIRE(dynmesh_rehearsal_create(k, DYNMESH_FLOAT64, &rehearsal) == DYNMESH_OK);
  dynmesh_tracker* tracker = nullptr;
  CHECK(dynmesh_tracker_create_with(mesh.indices.data(), n_faces, &first, 1, 1, rehearsal,
                                    &tracker) == DYNMESH_INVALID_ARGUMENT);
  CHECK(tracker == nullptr);
  CHECK(std::string(dynmesh_last_message()).starts_with("rehearsal: has 0 frames"));
  for (const auto& frame : take) {
    const dynmesh_points rows = {frame.data(), k, 3, 1, DYNMESH_FLOAT64};
    REQUIRE(dynmesh_rehearsal_add(rehearsal, &rows) == DYNMESH_OK);
  }
  REQUIRE(dynmesh_tracker_create_with(mesh.indices.data(), n_faces, &first, 1, 1, rehearsal,
                                      &tracker) == DYNMESH_OK);
  dynmesh_rehearsal_destroy(rehearsal);
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
  CHECK(expected.report().stages.trust > 0);
  std::vector<double> errors(mesh.size());
  REQUIRE(dynmesh_tracker_standard_error(tracker, errors.data(), k, DYNMESH_FLOAT64) == DYNMESH_OK);
  CHECK(errors == bars(expected));
  CHECK(dynmesh_tracker_standard_error(tracker, errors.data(), k, DYNMESH_FLOAT32) ==
        DYNMESH_INVALID_ARGUMENT);
  CHECK(dynmesh_tracker_standard_error(tracker, errors.data(), k - 1, DYNMESH_FLOAT64) ==
        DYNMESH_INVALID_ARGUMENT);
  CHECK(dynmesh_tracker_standard_error(tracker, nullptr, k, DYNMESH_FLOAT64) ==
        DYNMESH_INVALID_ARGUMENT);
  dynmesh_tracker_destroy(tracker);
}

}  // namespace
}  // namespace dynmesh::testing
