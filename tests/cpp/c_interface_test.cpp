/// Compares the C interface with the completer that it wraps.
#include <doctest/doctest.h>
#include <dynmesh/dynmesh.h>

#include <algorithm>
#include <cstring>
#include <dynmesh/alignment.hpp>
#include <dynmesh/completer.hpp>
#include <dynmesh/template_mesh.hpp>
#include <filesystem>
#include <fstream>
#include <limits>
#include <memory>
#include <thread>
#include <tuple>

#include "meshes.hpp"
#include "training_data.hpp"

// A C program in c_interface_from_c.c. Returns 0 on success and otherwise the line that failed.
extern "C" int run_c_program(void);

namespace dynmesh::testing {
namespace {

struct Destroy {
  void operator()(dynmesh_completer* completer) const { dynmesh_destroy(completer); }
};
using Handle = std::unique_ptr<dynmesh_completer, Destroy>;

template <class Real>
constexpr std::int32_t type_of = sizeof(Real) == 4 ? DYNMESH_FLOAT32 : DYNMESH_FLOAT64;

template <class Real>
dynmesh_points in(const std::vector<Real>& rows) {
  return {rows.data(), static_cast<std::int64_t>(rows.size() / 3), 3, 1, type_of<Real>};
}
template <class Real>
dynmesh_output out(std::vector<Real>& rows) {
  return {rows.data(), static_cast<std::int64_t>(rows.size() / 3), 3, 1, type_of<Real>};
}

template <class Real>
Handle create(const Mesh<Real>& mesh, const dynmesh_settings* settings = nullptr) {
  const auto first_frame = in(mesh.vertices);
  dynmesh_completer* completer = nullptr;
  const auto n_faces = static_cast<std::int64_t>(mesh.faces().count);
  CHECK(dynmesh_create(mesh.indices.data(), n_faces, &first_frame, settings, &completer) ==
        DYNMESH_OK);
  return Handle(completer);
}

std::vector<std::byte> state_of(const dynmesh_completer* completer) {
  std::int64_t size = 0;
  CHECK(dynmesh_state_size(completer, &size) == DYNMESH_OK);
  std::vector<std::byte> state(static_cast<std::size_t>(size));
  CHECK(dynmesh_state(completer, state.data(), size) == DYNMESH_OK);
  return state;
}

template <class Real>
bool same_bytes(const std::vector<Real>& a, const std::vector<Real>& b) {
  return a.size() == b.size() && std::memcmp(a.data(), b.data(), a.size() * sizeof(Real)) == 0;
}

/// The fields of a report of C or C++, except for the time.
template <class Report>
auto counts(const Report& report) {
  return std::tuple(
      static_cast<std::int64_t>(report.known), static_cast<std::int64_t>(report.filled),
      static_cast<std::int64_t>(report.disconnected), static_cast<std::int64_t>(report.rejected),
      static_cast<std::int64_t>(report.iterations));
}

/// A completer and its equivalent in the C interface, which must give the same results.
template <class Real>
struct Twins {
  Mesh<Real> mesh;
  Completer<Real> completer;
  Handle handle;
  std::vector<Real> expected;
  std::vector<Real> completed;

  explicit Twins(const Mesh<Real>& of, const Settings& settings = {},
                 const dynmesh_settings* c_settings = nullptr)
      : mesh(of),
        completer(mesh.faces(), mesh.points(), settings),
        handle(create(mesh, c_settings)),
        expected(mesh.vertices.size()),
        completed(mesh.vertices.size()) {}

  Points<Real> expected_view() { return {expected.data(), mesh.size()}; }

  void check(dynmesh_status status, const FrameReport& theirs, const dynmesh_frame_report& ours) {
    REQUIRE(status == DYNMESH_OK);
    CHECK(same_bytes(expected, completed));
    CHECK(counts(ours) == counts(theirs));
    CHECK(ours.seconds > 0);
    CHECK(ours.blend == theirs.stages.blend);
    CHECK(ours.prior_weight == theirs.stages.prior_weight);
    CHECK(ours.prior_share == theirs.stages.prior_share);
    CHECK(ours.first_order_share == theirs.stages.first_order_share);
    CHECK(ours.standard_error == theirs.standard_error);
    dynmesh_frame_report again{};
    CHECK(dynmesh_report(handle.get(), &again) == DYNMESH_OK);
    CHECK(std::memcmp(&again, &ours, sizeof ours) == 0);
    CHECK(std::equal(completer.generation().begin(), completer.generation().end(),
                     dynmesh_generation(handle.get())));
    CHECK(std::equal(completer.age().begin(), completer.age().end(), dynmesh_age(handle.get())));
  }

  /// Completes frame `number`, with each of the functions in turn.
  void step(unsigned number) {
    const std::size_t k = mesh.size();
    auto moved = turned(mesh.vertices, 0.03 * number);
    const auto known = random_mask(k, 0.1 * (1 + number % 9), number);
    const auto output = out(completed);
    dynmesh_frame_report report{};
    if (number % 4 == 0) {
      const auto points = in(moved);
      const dynmesh_mask mask = {known.data(), static_cast<std::int64_t>(k), 1};
      const auto theirs = completer.push({moved.data(), k}, {known.data(), k}, expected_view());
      check(dynmesh_push(handle.get(), &points, &mask, &output, &report), theirs, report);
    } else if (number % 4 == 1) {
      for (std::size_t v = 0; v < k; ++v) {
        if (known[v] == 0) moved[3 * v + 1] = std::numeric_limits<Real>::quiet_NaN();
      }
      const auto points = in(moved);
      const auto theirs = completer.push({moved.data(), k}, expected_view());
      check(dynmesh_push(handle.get(), &points, nullptr, &output, &report), theirs, report);
    } else if (number % 4 == 2) {
      const Sparse<Real> sparse(moved, known);
      const auto& indices = sparse.indices;
      const auto points = in(sparse.points);
      const auto theirs =
          completer.push_sparse(indices, {sparse.points.data(), indices.size()}, expected_view());
      check(dynmesh_push_sparse(handle.get(), indices.data(), points.count, &points, &output,
                                &report),
            theirs, report);
    } else {
      const auto theirs = completer.skip(expected_view());
      check(dynmesh_skip(handle.get(), &output, &report), theirs, report);
    }
  }
};

template <class Real>
Mesh<Real> parts() {
  return join(join(sheet<Real>(12), sheet<Real>(4, 20.0)), sheet<Real>(2, 30.0));
}

TEST_CASE_TEMPLATE("C and C++ complete frames identically", Real, float, double) {
  Twins<Real> twins(parts<Real>());
  CHECK(dynmesh_n_vertices(twins.handle.get()) == static_cast<std::int64_t>(twins.mesh.size()));
  for (unsigned number = 1; number < 30; ++number) twins.step(number);

  SUBCASE("a state is restored in another completer") {
    const auto state = state_of(twins.handle.get());
    REQUIRE(state == twins.completer.state());  // a state contains no times
    for (unsigned number = 30; number < 34; ++number) twins.step(number);
    const auto last = twins.completed;
    Handle other = create(twins.mesh);
    const auto size = static_cast<std::int64_t>(state.size());
    REQUIRE(dynmesh_restore(other.get(), state.data(), size) == DYNMESH_OK);
    twins.handle = std::move(other);
    twins.completer.restore(state);
    for (unsigned number = 30; number < 34; ++number) twins.step(number);
    CHECK(same_bytes(twins.completed, last));
  }
  SUBCASE("after a reset") {
    twins.mesh.vertices = turned(twins.mesh.vertices, 1.0);
    const auto frame = in(twins.mesh.vertices);
    twins.completer.reset(twins.mesh.points());
    REQUIRE(dynmesh_reset(twins.handle.get(), &frame) == DYNMESH_OK);
    for (unsigned number = 1; number < 9; ++number) twins.step(number);
  }
  SUBCASE("push_sparse without observed vertices") {
    const dynmesh_points none = {nullptr, 0, 3, 1, type_of<Real>};
    const auto output = out(twins.completed);
    dynmesh_frame_report report{};
    const auto theirs = twins.completer.skip(twins.expected_view());
    twins.check(dynmesh_push_sparse(twins.handle.get(), nullptr, 0, &none, &output, &report),
                theirs, report);
  }
  SUBCASE("one interleaved buffer in reverse order, and no report") {
    struct Vertex {
      Real in[3];
      Real out[3];
      std::uint8_t known;
    };
    const std::size_t k = twins.mesh.size();
    const auto moved = turned(twins.mesh.vertices, 1.0);
    const auto known = random_mask(k, 0.3, 1);
    std::vector<Vertex> buffer(k);
    for (std::size_t v = 0; v < k; ++v) {
      std::memcpy(buffer[k - 1 - v].in, &moved[3 * v], sizeof buffer[0].in);
      buffer[k - 1 - v].known = known[v];
    }
    const auto count = static_cast<std::int64_t>(k);
    constexpr auto pitch = -static_cast<std::int64_t>(sizeof(Vertex) / sizeof(Real));
    const dynmesh_points points = {buffer[k - 1].in, count, pitch, 1, type_of<Real>};
    const dynmesh_output output = {buffer[k - 1].out, count, pitch, 1, type_of<Real>};
    const dynmesh_mask mask = {&buffer[k - 1].known, count,
                               -static_cast<std::int64_t>(sizeof(Vertex))};
    REQUIRE(dynmesh_push(twins.handle.get(), &points, &mask, &output, nullptr) == DYNMESH_OK);
    twins.completer.push({moved.data(), k}, {known.data(), k}, twins.expected_view());
    for (std::size_t v = 0; v < k; ++v) {
      CHECK(std::memcmp(buffer[k - 1 - v].out, &twins.expected[3 * v], sizeof buffer[0].out) == 0);
    }
  }
}

TEST_CASE("every setting is passed on") {
  dynmesh_settings c_settings{};
  REQUIRE(dynmesh_default_settings(&c_settings, sizeof c_settings) == DYNMESH_OK);
  Settings settings;
  const auto take_motion = [&] {
    c_settings.method = DYNMESH_METHOD_MOTION;
    settings.method = Method::motion;
  };
  const auto steps = [&] {
    Twins<float> twins(parts<float>(), settings, &c_settings);
    for (unsigned number = 1; number < 12; ++number) twins.step(number);
    return twins.completed;
  };
  SUBCASE("method") {
    const auto usual = steps();
    take_motion();
    CHECK(!same_bytes(steps(), usual));
    return;
  }
  take_motion();
  const auto usual = steps();
  SUBCASE("revisit") { c_settings.revisit = settings.revisit = false; }
  SUBCASE("extra_iterations") { c_settings.extra_iterations = settings.extra_iterations = 5; }
  SUBCASE("disconnected") {
    c_settings.disconnected = DYNMESH_DISCONNECTED_HOLD;
    settings.disconnected = DisconnectedRule::hold;
  }
  CHECK(!same_bytes(steps(), usual));
}

struct DestroyTraining {
  void operator()(dynmesh_training* training) const { dynmesh_training_destroy(training); }
};
using TrainingHandle = std::unique_ptr<dynmesh_training, DestroyTraining>;

TEST_CASE_TEMPLATE("a completer learns from a training sequence, which it does not need later",
                   Real, float, double) {
  const Settings settings = {.method = Method::detail};
  dynmesh_settings c_settings{};
  REQUIRE(dynmesh_default_settings(&c_settings, sizeof c_settings) == DYNMESH_OK);
  c_settings.method = DYNMESH_METHOD_DETAIL;
  Twins<Real> twins(parts<Real>(), settings, &c_settings);
  const Mesh<Real>& mesh = twins.mesh;
  const auto shown = training_frames_of(mesh.vertices, 6);
  dynmesh_training* made = nullptr;
  const auto k = static_cast<std::int64_t>(mesh.size());
  REQUIRE(dynmesh_training_create(k, type_of<Real>, &made) == DYNMESH_OK);
  TrainingHandle training(made);
  for (const auto& frame : shown) {
    const auto points = in(frame);
    REQUIRE(dynmesh_training_add(training.get(), &points) == DYNMESH_OK);
  }
  const auto first_frame = in(mesh.vertices);
  const auto n_faces = static_cast<std::int64_t>(mesh.faces().count);
  for (const bool is_destroyed_first : {false, true}) {
    dynmesh_completer* completer = nullptr;
    REQUIRE(dynmesh_create_trained(mesh.indices.data(), n_faces, &first_frame, &c_settings,
                                   training.get(), &completer) == DYNMESH_OK);
    twins.handle.reset(completer);
    twins.completer = {mesh.faces(), mesh.points(), settings, training_of(shown)};
    if (is_destroyed_first) training.reset();
    for (unsigned number = 4; number < 11; ++number) twins.step(number);
    CHECK(state_of(completer) == twins.completer.state());
  }
  CHECK(twins.completer.report().stages.blend != 0);
}

TEST_CASE("the topology is reported") {
  Mesh<float> mesh = sheet<float>(4);
  mesh.indices.insert(mesh.indices.end(), {0, 0, 1, 0, 1, 4});
  mesh.vertices.insert(mesh.vertices.end(), {9, 9, 9});
  const Handle handle = create(mesh);
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

TEST_CASE_TEMPLATE("strides of 0 mean packed arrays", Real, float, double) {
  Twins<Real> twins(parts<Real>());
  const auto known = random_mask(twins.mesh.size(), 0.3, 1);
  const auto moved = turned(twins.mesh.vertices, 0.4);
  auto points = in(moved);
  auto output = out(twins.completed);
  dynmesh_mask mask = {known.data(), points.count, 0};
  for (const std::int64_t column_stride : {0, 1}) {
    points.row_stride = output.row_stride = 0;
    points.column_stride = output.column_stride = column_stride;
    dynmesh_frame_report report{};
    const auto theirs = twins.completer.push({moved.data(), known.size()},
                                             {known.data(), known.size()}, twins.expected_view());
    twins.check(dynmesh_push(twins.handle.get(), &points, &mask, &output, &report), theirs, report);
  }
  points.row_stride = 3;
  points.column_stride = 0;
  CHECK(dynmesh_reset(twins.handle.get(), &points) == DYNMESH_OK);
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
  const Handle handle = create(sheet<float>(3));
  CHECK(std::string(dynmesh_last_message()) == "settings: is a null pointer");
}

TEST_CASE_TEMPLATE("C finds the alignment that C++ finds", Real, float, double) {
  const Mesh<Real> mesh = sheet<Real>(12);
  const auto scan = translated(turned(mesh.vertices, 0.8), Real{40}, Real{-3}, Real{7});
  const auto theirs =
      find_alignment<Real>(mesh.faces(), mesh.points(), {scan.data(), scan.size() / 3});
  const auto first_frame = in(mesh.vertices);
  const auto points = in(scan);
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

TEST_CASE("a C program compiles, links and runs") { CHECK(run_c_program() == 0); }

}  // namespace
}  // namespace dynmesh::testing
