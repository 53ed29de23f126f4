/// Tracking, registration and alignment by the C interface do what they do in C++.
#include <doctest/doctest.h>
#include <dynmesh/dynmesh.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <dynmesh/registration.hpp>
#include <span>
#include <string>
#include <tuple>
#include <vector>

#include "c_completer.hpp"
#include "meshes.hpp"
#include "scans.hpp"
#include "training_data.hpp"

namespace dynmesh::testing {
namespace {

/// The numbers of an agreement of C or C++, with -1 for NaN, which equals nothing.
template <class A>
auto numbers_of(const A& of) {
  const auto number = [](double x) { return std::isnan(x) ? -1 : x; };
  return std::tuple(static_cast<std::int64_t>(of.points), number(of.far_share),
                    number(of.disagreeing), number(of.distance));
}

void check_equal(const dynmesh_measure& ours, const Measure& theirs) {
  CHECK(numbers_of(ours.agreement) == numbers_of(theirs.agreement));
  CHECK(std::isnan(ours.unexplained) == std::isnan(theirs.unexplained));
  if (!std::isnan(ours.unexplained)) CHECK(ours.unexplained == theirs.unexplained);
  CHECK(std::tuple(ours.hole, ours.overlap, ours.stretch, ours.growth, ours.seen) ==
        std::tuple(theirs.hole, theirs.overlap, theirs.stretch, theirs.growth, theirs.seen));
  CHECK(static_cast<Quality>(ours.quality) == theirs.quality);
  CHECK(std::string(ours.reason) == theirs.reason());
}

TEST_CASE("a tracker") {
  const auto mesh = bumpy_torus(24);
  TrackerSettings settings;
  std::vector<std::vector<double>> shown;
  SUBCASE("alone") {}
  SUBCASE("with training and standard errors") {
    settings.uncertainty = true;
    shown = training_frames_of(mesh.vertices, 4);
  }
  SUBCASE("that recovers") { settings.recover = true; }
  SUBCASE("that is live") { settings.resolution = 100; }
  auto expected = shown.empty()
                      ? Tracker<double>(mesh.faces(), mesh.points(), settings)
                      : Tracker<double>(mesh.faces(), mesh.points(), settings, training_of(shown));
  const std::size_t k = mesh.size();
  const auto first = c_rows(mesh.vertices);
  const auto n_faces = static_cast<std::int64_t>(mesh.faces().count);
  dynmesh_training* training = nullptr;
  dynmesh_tracker* tracker = nullptr;
  const auto create = [&] {
    return dynmesh_tracker_create_with(mesh.indices.data(), n_faces, &first, 1,
                                       settings.uncertainty ? 1 : 0, settings.recover ? 1 : 0,
                                       settings.resolution, training, &tracker);
  };
  if (!shown.empty()) {
    REQUIRE(dynmesh_training_create(first.count, first.type, &training) == DYNMESH_OK);
    CHECK(create() == DYNMESH_INVALID_ARGUMENT);  // without a frame
  }
  for (const auto& frame : shown) {
    const auto rows = c_rows(frame);
    REQUIRE(dynmesh_training_add(training, &rows) == DYNMESH_OK);
  }
  REQUIRE(create() == DYNMESH_OK);
  dynmesh_training_destroy(training);

  std::vector<double> found(3 * k);
  const auto out = c_out(found);
  dynmesh_tracking_report report{};
  const auto check_same = [&](const std::vector<double>& frame) {
    CHECK(found == frame);
    const auto& theirs = expected.report();
    CHECK(report.known == static_cast<std::int64_t>(theirs.known));
    CHECK(report.recovered == (theirs.recovered ? 1 : 0));
    check_equal(report.measure, theirs.measure);
    CHECK(std::ranges::equal(expected.observed(), std::span(dynmesh_tracker_observed(tracker), k)));
    CHECK(std::ranges::equal(expected.age(), std::span(dynmesh_tracker_age(tracker), k)));
    CHECK(std::ranges::equal(expected.generation(),
                             std::span(dynmesh_tracker_generation(tracker), k)));
    std::vector<double> errors(k);
    const auto status =
        dynmesh_tracker_standard_error(tracker, errors.data(), first.count, DYNMESH_FLOAT64);
    CHECK((status == DYNMESH_OK) == settings.uncertainty);
    if (settings.uncertainty) CHECK(std::ranges::equal(expected.standard_error(), errors));
  };
  const auto jumped = translated(turned(mesh.vertices, 2.1), 40.0, 0.0, 0.0);
  for (const auto& truth : {bent(mesh.vertices, 0.4), bent(mesh.vertices, 0.8), jumped}) {
    auto scan = scan_of(mesh, truth);
    scan.viewpoints = {9, 0, 0, -9, 0, 0};
    const auto points = c_rows(scan.points);
    const auto normals = c_rows(scan.normals);
    scan.colours = scan.normals;
    const auto sensors = c_rows(scan.viewpoints);
    const auto colours = c_rows(scan.colours);
    REQUIRE(dynmesh_tracker_push(tracker, &points, &normals, &sensors, &colours, &out, &report) ==
            DYNMESH_OK);
    check_same(track(expected, scan));
  }
  CHECK((report.recovered != 0) == settings.recover);
  CHECK((expected.report().stages.prior_weight > 0) == !shown.empty());
  std::int64_t size = 0;
  REQUIRE(dynmesh_tracker_state_size(tracker, &size) == DYNMESH_OK);
  std::vector<std::byte> state(static_cast<std::size_t>(size));
  REQUIRE(dynmesh_tracker_state(tracker, state.data(), size) == DYNMESH_OK);
  CHECK(state == expected.state());
  REQUIRE(dynmesh_tracker_skip(tracker, &out, nullptr) == DYNMESH_OK);
  CHECK(dynmesh_tracker_age(tracker)[3] == expected.age()[3] + 1);
  REQUIRE(dynmesh_tracker_restore(tracker, state.data(), size) == DYNMESH_OK);
  CHECK(dynmesh_tracker_age(tracker)[3] == expected.age()[3]);

  const auto images = images_of(mesh, settings.recover ? jumped : mesh.vertices, 1, 60);
  const auto view = images[0].view();
  dynmesh_depth_image image{view.data, 60, 60, 0, 0, {}, {}, nullptr};
  std::ranges::copy(view.intrinsics, image.intrinsics);
  std::ranges::copy(view.pose, image.pose);
  REQUIRE(dynmesh_tracker_push_depth(tracker, &image, 1, &out, &report) == DYNMESH_OK);
  std::vector<double> frame(3 * k);
  expected.push_depth({&view, 1}, {frame.data(), k});
  check_same(frame);
  CHECK(dynmesh_tracker_reset(tracker, &first) == DYNMESH_OK);
  CHECK(dynmesh_tracker_age(tracker)[3] == 0);
  dynmesh_tracker_destroy(tracker);
}

TEST_CASE("a registration") {
  const auto mesh = bumpy_torus(24);
  Samples scan;  // by a sensor above, which does not see the lower half
  const auto whole = scan_of(mesh, translated(turned(mesh.vertices, 2.0), 30.0, -14.0, 5.0));
  for (std::size_t i = 0; i < whole.points.size(); i += 3) {
    if (whole.normals[i + 2] < 0) continue;
    scan.points.insert(scan.points.end(), &whole.points[i], &whole.points[i] + 3);
    scan.normals.insert(scan.normals.end(), &whole.normals[i], &whole.normals[i] + 3);
  }
  scan.viewpoints = {30, -14, 90};
  const Points<const double> measured(scan.points.data(), scan.points.size() / 3);
  const auto found_by = [&](std::size_t n_sensors) {
    return register_template<double>(
        mesh.faces(), mesh.points(),
        {measured, {scan.normals.data(), measured.count}, {scan.viewpoints.data(), n_sensors}}, {},
        {.uncertainty = true});
  };
  const auto expected = found_by(1);
  CHECK(expected.hole < 0.5 * found_by(0).hole);
  const auto positions = c_rows(mesh.vertices);
  const auto points = c_rows(scan.points);
  const auto normals = c_rows(scan.normals);
  const auto viewpoints = c_rows(scan.viewpoints);
  dynmesh_registration_request request{};
  request.faces = mesh.indices.data();
  request.n_faces = static_cast<std::int64_t>(mesh.faces().count);
  request.positions = &positions;
  request.points = &points;
  request.normals = &normals;
  request.viewpoints = &viewpoints;
  request.align = request.threads = 1;
  std::vector<double> vertices(3 * mesh.size());
  const auto out = c_out(vertices);
  std::vector<std::uint8_t> observed(mesh.size());
  std::vector<double> errors(mesh.size());
  dynmesh_registration_report report{};
  REQUIRE(dynmesh_register(&request, &out, observed.data(), errors.data(), &report) == DYNMESH_OK);
  CHECK(vertices == expected.vertices);
  CHECK(observed == expected.observed);
  CHECK(errors == expected.standard_error);
  check_equal(report.measure, expected);
  CHECK(report.measure.quality == DYNMESH_GOOD);
  CHECK(std::tuple(report.transform[3], report.scale) ==
        std::tuple(expected.transform[3], expected.scale));
}

}  // namespace
}  // namespace dynmesh::testing
