/// C does what C++ does, and what it has of its own: messages, null handles, templates. Completers
/// are compared by tests/fuzz/completer.cpp.
#include <doctest/doctest.h>
#include <dynmesh/dynmesh.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <dynmesh/alignment.hpp>
#include <dynmesh/registration.hpp>
#include <dynmesh/template_mesh.hpp>
#include <dynmesh/whole_frame.hpp>
#include <filesystem>
#include <fstream>
#include <limits>
#include <thread>
#include <tuple>

#include "c_completer.hpp"
#include "meshes.hpp"
#include "scans.hpp"
#include "training_data.hpp"

// The layout that other languages declare.
static_assert(sizeof(dynmesh_points) == 40 && offsetof(dynmesh_points, type) == 32);
static_assert(sizeof(dynmesh_output) == 40 && offsetof(dynmesh_output, type) == 32);
static_assert(sizeof(dynmesh_mask) == 24);
static_assert(sizeof(dynmesh_settings) == 48 && offsetof(dynmesh_settings, noise) == 24);
static_assert(sizeof(dynmesh_frame_report) == 608 && offsetof(dynmesh_frame_report, reason) == 92);
static_assert(sizeof(dynmesh_topology_report) == 32);
static_assert(sizeof(dynmesh_template) == 32);
static_assert(sizeof(dynmesh_measure) == 600 && offsetof(dynmesh_measure, reason) == 84);
static_assert(sizeof(dynmesh_tracking_report) == 648);
static_assert(sizeof(dynmesh_agreement) == 32);
static_assert(sizeof(dynmesh_depth_image) == 240);

namespace dynmesh::testing {
namespace {

TEST_CASE("what arguments of another size would overwrite is kept") {
  const auto mesh = sheet<float>(3);
  const CCompleter<float> completer(mesh.faces(), mesh.points(), {.uncertainty = true});
  std::vector<float> values(9, 7);
  const auto refused = [&](std::int64_t count, std::int32_t type, const char* argument) {
    const auto status = dynmesh_standard_error(completer.get(), values.data(), count, type);
    CHECK(status == DYNMESH_INVALID_ARGUMENT);
    CHECK(std::string(dynmesh_last_message()).starts_with(argument));
    CHECK(values == std::vector<float>(9, 7));
  };
  refused(8, DYNMESH_FLOAT32, "count:");
  refused(10, DYNMESH_FLOAT32, "count:");
  refused(9, DYNMESH_FLOAT64, "type:");
}

TEST_CASE("the topology is reported") {
  Mesh<float> mesh = sheet<float>(4);
  mesh.indices.insert(mesh.indices.end(), {0, 0, 1, 0, 1, 4});
  mesh.vertices.insert(mesh.vertices.end(), {9, 9, 9});
  const CCompleter<float> handle(mesh.faces(), mesh.points());
  const Completer<float> completer(mesh.faces(), mesh.points());
  const TopologyReport& expected = completer.topology();
  dynmesh_topology_report report{};
  REQUIRE(dynmesh_topology(handle.get(), &report) == DYNMESH_OK);
  CHECK(report.components == 2);
  CHECK(report.isolated_vertices == 1);
  CHECK(report.boundary_edges == static_cast<std::int64_t>(expected.boundary_edges));
  REQUIRE(report.refused_faces == 2);
  for (std::int64_t number = 0; number < 2; ++number) {
    std::int64_t face = 0;
    const char* reason = nullptr;
    REQUIRE(dynmesh_refused_face(handle.get(), number, &face, &reason) == DYNMESH_OK);
    CHECK(face == 18 + number);
    CHECK(reason == expected.refused_faces[static_cast<std::size_t>(number)].reason);
  }
}

TEST_CASE("a null completer has nothing and is destroyed like any other") {
  CHECK(dynmesh_n_vertices(nullptr) == 0);
  CHECK(dynmesh_generation(nullptr) == nullptr);
  CHECK(dynmesh_age(nullptr) == nullptr);
  dynmesh_destroy(nullptr);
  dynmesh_training_destroy(nullptr);
  dynmesh_free_template(nullptr);
}

TEST_CASE("long messages are cut between two characters") {
  const dynmesh_template* mesh = nullptr;
  for (const std::string character : {"x", "\u00e9", "\u20ac", "\U0001f98c"}) {
    for (std::size_t shift = 0; shift < character.size(); ++shift) {
      std::string name(shift, 'x');
      while (name.size() < 1200) name += character;
      CHECK(dynmesh_read_template(name.c_str(), &mesh) == DYNMESH_UNREADABLE_FILE);
      const std::size_t whole = (1023 - shift) / character.size();
      CHECK(std::string(dynmesh_last_message()) ==
            name.substr(0, shift + whole * character.size()));
    }
  }
  // Bytes that are not UTF-8 are not searched for the beginning of a character.
  const std::string no_text(1200, '\x80');
  CHECK(dynmesh_read_template(no_text.c_str(), &mesh) == DYNMESH_UNREADABLE_FILE);
  CHECK(std::string(dynmesh_last_message()).size() == 1020);
}

TEST_CASE("each thread has its own last message, which successful calls keep") {
  CHECK(dynmesh_default_settings(nullptr, sizeof(dynmesh_settings)) == DYNMESH_INVALID_ARGUMENT);
  std::string elsewhere = "?";
  std::thread([&] { elsewhere = dynmesh_last_message(); }).join();
  CHECK(elsewhere.empty());
  const auto mesh = sheet<float>(3);
  const CCompleter<float> completer(mesh.faces(), mesh.points());
  CHECK(std::string(dynmesh_last_message()) == "settings: is a null pointer");
}

TEST_CASE("templates are read, or refused with their path") {
  const auto folder = std::filesystem::temp_directory_path() / "dynmesh-c-interface-test";
  std::filesystem::create_directories(folder);
  const std::string path = (folder / "quad.obj").string();
  std::ofstream(path) << "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0.5\nf 1 2 3 4\n";
  const dynmesh_template* mesh = nullptr;
  REQUIRE(dynmesh_read_template(path.c_str(), &mesh) == DYNMESH_OK);
  const TemplateMesh expected = read_template(path);
  REQUIRE(mesh->n_vertices == 4);
  REQUIRE(mesh->n_faces == 2);
  CHECK(std::equal(expected.vertices.begin(), expected.vertices.end(), mesh->vertices));
  CHECK(std::equal(expected.faces.begin(), expected.faces.end(), mesh->faces));
  dynmesh_free_template(mesh);

  const std::string missing = (folder / (std::string(200, 'x') + ".ply")).string();
  CHECK(dynmesh_read_template(missing.c_str(), &mesh) == DYNMESH_UNREADABLE_FILE);
  CHECK(mesh == nullptr);
  CHECK(std::string(dynmesh_last_message()) == missing + ": cannot be opened");
  std::filesystem::remove_all(folder);
}

TEST_CASE("the settings of C begin as those of C++") {
  dynmesh_settings settings{};
  REQUIRE(dynmesh_default_settings(&settings, sizeof settings) == DYNMESH_OK);
  const Settings theirs;
  CHECK(settings.method == DYNMESH_METHOD_DETAIL);
  CHECK(settings.disconnected == DYNMESH_DISCONNECTED_FOLLOW);
  CHECK(std::isnan(settings.noise));
  CHECK(std::tuple(settings.revisit, settings.extra_iterations, settings.reject_outliers,
                   settings.learn, settings.uncertainty, settings.threads) ==
        std::tuple(theirs.revisit, theirs.extra_iterations, theirs.reject_outliers, theirs.learn,
                   theirs.uncertainty, theirs.threads));
}

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
    const auto sensors = expected.agreement_of_sensors();
    dynmesh_agreement found_of[2] = {{-1, 0, 0, 0}, {-1, 0, 0, 0}};
    std::int64_t n_sensors = 0;
    REQUIRE(dynmesh_tracker_agreement_of_sensors(tracker, found_of, 2, &n_sensors) == DYNMESH_OK);
    REQUIRE(n_sensors == std::ssize(sensors));
    for (std::size_t i = 0; i < 2; ++i) {
      if (i < sensors.size()) CHECK(numbers_of(found_of[i]) == numbers_of(sensors[i]));
      if (i >= sensors.size()) CHECK(found_of[i].points == -1);
    }
  };
  const auto jumped = translated(turned(mesh.vertices, 2.1), 40.0, 0.0, 0.0);
  for (const auto& truth : {bent(mesh.vertices, 0.4), bent(mesh.vertices, 0.8), jumped}) {
    auto scan = scan_of(mesh, truth);
    scan.viewpoints = {9, 0, 0, -9, 0, 0};
    const auto points = c_rows(scan.points);
    const auto normals = c_rows(scan.normals);
    const auto sensors = c_rows(scan.viewpoints);
    REQUIRE(dynmesh_tracker_push(tracker, &points, &normals, &sensors, &out, &report) ==
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
  dynmesh_depth_image image{view.data, 60, 60, 0, 0, {}, {}};
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

TEST_CASE_TEMPLATE("an alignment", Real, float, double) {
  const Mesh<Real> mesh = sheet<Real>(12);
  const auto scan = translated(turned(mesh.vertices, 0.8), Real{40}, Real{-3}, Real{7});
  const Points<const Real> measured(scan.data(), scan.size() / 3);
  const auto theirs = find_alignment<Real>(mesh.faces(), mesh.points(), measured);
  const auto first_frame = c_view<dynmesh_points>(mesh.points());
  const auto points = c_view<dynmesh_points>(measured);
  dynmesh_alignment ours{};
  CHECK(dynmesh_find_alignment(mesh.indices.data(), static_cast<std::int64_t>(mesh.faces().count),
                               &first_frame, &points, &ours) == DYNMESH_OK);
  CHECK(std::ranges::equal(ours.rotation, theirs.rotation));
  CHECK(std::ranges::equal(ours.shift, theirs.shift));
  CHECK(std::tuple(ours.mean_edge, ours.before, ours.after, ours.ratio) ==
        std::tuple(theirs.mean_edge, theirs.before, theirs.after, theirs.ratio));
  CHECK(theirs.matches);
  CHECK(std::tuple(ours.lies_in_scan, ours.matches, ours.other_unit) == std::tuple(0, 1, 0));
}

/// Frames of a turning torus, of which each knows a part.
struct Turning {
  Mesh<double> mesh = torus(9);

  void read(std::int64_t t, double* points, std::uint8_t* known) const {
    const auto share = t == 3 ? 0.6 : 0.5;
    std::ranges::copy(turned(mesh.vertices, 0.05 * static_cast<double>(t)), points);
    std::ranges::copy(random_mask(mesh.size(), share, static_cast<unsigned>(t)), known);
  }
};

TEST_CASE("a whole frame, which C can stop") {
  Turning turning;
  constexpr std::int64_t n_frames = 12;
  const FrameSource<double> source = [&](std::size_t t, Points<double> points,
                                         std::span<std::uint8_t> known) {
    turning.read(static_cast<std::int64_t>(t), points.data, known.data());
  };
  const auto whole = whole_frame(turning.mesh.faces(), turning.mesh.size(), n_frames, source, {});
  dynmesh_whole_frame_request request{};
  request.faces = turning.mesh.indices.data();
  request.n_faces = static_cast<std::int64_t>(turning.mesh.faces().count);
  request.n_frames = n_frames;
  request.source = [](void* context, std::int64_t t, void* points, std::uint8_t* known) {
    static_cast<const Turning*>(context)->read(t, static_cast<double*>(points), known);
    return 0;
  };
  request.context = &turning;
  request.frame = -1;
  request.noise = std::numeric_limits<double>::quiet_NaN();
  request.threads = 3;  // and so the same with any number
  std::vector<double> positions(3 * turning.mesh.size());
  std::vector<std::uint8_t> seen(turning.mesh.size());
  std::vector<double> errors(turning.mesh.size());
  const auto output = c_out(positions);
  dynmesh_whole_frame_report report{};
  const auto call = [&] {
    return dynmesh_whole_frame(&request, &output, seen.data(), errors.data(), &report);
  };
  REQUIRE(call() == DYNMESH_OK);
  CHECK(positions == whole.positions);
  CHECK(seen == whole.seen);
  CHECK(errors == whole.standard_error);
  CHECK(std::tuple(report.frame, report.doubtful) == std::tuple(3, 0));

  request.progress = [](void* /*context*/, std::int64_t done, std::int64_t /*of*/) {
    return done < 5 ? 0 : 1;
  };
  CHECK(call() == DYNMESH_STOPPED);
  CHECK(std::string(dynmesh_last_message()).find("stopped after 5 of ") == 0);
  request.frame = -2;
  CHECK(call() == DYNMESH_INVALID_ARGUMENT);
  request.source = nullptr;
  CHECK(call() == DYNMESH_INVALID_ARGUMENT);
}

TEST_CASE("frames of a whole one are read in order, twice, and only those that are used") {
  const Mesh<double> mesh = sheet<double>(3);
  std::vector<std::size_t> read;
  const FrameSource<double> source = [&](std::size_t t, Points<double> points,
                                         std::span<std::uint8_t> known) {
    read.push_back(t);
    std::ranges::copy(mesh.vertices, points.data);
    std::ranges::fill(known, std::uint8_t{1});
  };
  const std::size_t n = 2000;
  const auto whole = whole_frame(mesh.faces(), mesh.size(), n, source);
  CHECK(whole.positions == mesh.vertices);
  CHECK(whole.frame == n / 2 - 1);  // the one nearest to the middle
  const auto second = read.begin() + static_cast<std::ptrdiff_t>(n);
  CHECK(std::is_sorted(read.begin(), second));
  CHECK(std::is_sorted(second, read.end()));
  CHECK(read.end() - second < 300);
  for (std::size_t t = whole.frame - 30; t <= whole.frame + 30; ++t) {
    CHECK(std::find(second, read.end(), t) != read.end());
  }
  CHECK(*second < 50);
  CHECK(read.back() > n - 50);
}

}  // namespace
}  // namespace dynmesh::testing
