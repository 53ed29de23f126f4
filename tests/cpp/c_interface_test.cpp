/// Compares the C interface with the completer that it wraps.
#include <doctest/doctest.h>
#include <dynmesh/dynmesh.h>

#include <cstring>
#include <dynmesh/completer.hpp>
#include <dynmesh/template_mesh.hpp>
#include <filesystem>
#include <fstream>
#include <limits>
#include <memory>
#include <thread>
#include <tuple>

#include "meshes.hpp"

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
      static_cast<std::int64_t>(report.unseen), static_cast<std::int64_t>(report.rejected),
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
      std::vector<Index> indices;
      std::vector<Real> observed;
      for (std::size_t v = k; v-- > 0;) {
        if (known[v] == 0) continue;
        indices.push_back(static_cast<Index>(v));
        observed.insert(observed.end(), {moved[3 * v], moved[3 * v + 1], moved[3 * v + 2]});
      }
      const auto points = in(observed);
      const auto theirs =
          completer.push_sparse(indices, {observed.data(), indices.size()}, expected_view());
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
  const auto steps = [&] {
    Twins<float> twins(parts<float>(), settings, &c_settings);
    for (unsigned number = 1; number < 12; ++number) twins.step(number);
    return twins.completed;
  };
  const auto usual = steps();
  SUBCASE("revisit") { c_settings.revisit = settings.revisit = false; }
  SUBCASE("extra_iterations") { c_settings.extra_iterations = settings.extra_iterations = 5; }
  SUBCASE("unseen") {
    c_settings.unseen = DYNMESH_UNSEEN_HOLD;
    settings.unseen = UnseenRule::hold;
  }
  CHECK(!same_bytes(steps(), usual));
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

TEST_CASE("bad calls are refused with the messages of the completer, and change nothing") {
  const Mesh<float> mesh = sheet<float>(4);
  constexpr std::int64_t k = 16;
  const Handle handle = create(mesh);
  dynmesh_completer* const c = handle.get();
  std::vector<float> completed(3 * k, 7.0F);
  const auto untouched = completed;
  const auto before = state_of(c);
  const auto points = in(mesh.vertices);
  const auto output = out(completed);
  const auto refused = [&](dynmesh_status status, const std::string& message) {
    CHECK(status == DYNMESH_INVALID_ARGUMENT);
    CHECK(std::string(dynmesh_last_message()) == message);
    CHECK(state_of(c) == before);
    CHECK(completed == untouched);
  };
  const auto push = [&](const dynmesh_points& given) {
    return dynmesh_push(c, &given, nullptr, &output, nullptr);
  };
  const auto write = [&](const dynmesh_output& given) {
    return dynmesh_push(c, &points, nullptr, &given, nullptr);
  };
  const auto mask = [&](const dynmesh_mask& given) {
    return dynmesh_push(c, &points, &given, &output, nullptr);
  };
  float* const data = completed.data();
  void* const askew = reinterpret_cast<char*>(data) + 1;
  constexpr std::int64_t huge = std::numeric_limits<std::int64_t>::max();

  refused(dynmesh_push(nullptr, &points, nullptr, &output, nullptr),
          "completer: is a null pointer");
  refused(dynmesh_push(c, nullptr, nullptr, &output, nullptr), "points: is a null pointer");
  refused(dynmesh_push(c, &points, nullptr, nullptr, nullptr), "out: is a null pointer");
  refused(push({nullptr, k, 3, 1, 32}), "points: is a null pointer");
  refused(push({data, -1, 3, 1, 32}), "points: cannot have -1 rows");
  refused(push({data, huge, 3, 1, 32}), "points: cannot have 9223372036854775807 rows");
  refused(push({data, 15, 3, 1, 32}), "points: has 15 rows, but the mesh has 16 vertices");
  refused(push({data, k, 3, 1, 64}), "points: type must be 32, that of the first frame, not 64");
  refused(push({data, k, 3, 1, 0}), "points: type must be 32, that of the first frame, not 0");
  refused(push({askew, k, 3, 1, 32}), "points: is not aligned to 4 bytes");
  refused(write({nullptr, k, 3, 1, 32}), "out: is a null pointer");
  refused(write({data, -5, 3, 1, 32}), "out: cannot have -5 rows");
  refused(write({data, k, 3, 1, 64}), "out: type must be 32, that of the first frame, not 64");
  refused(write({askew, k, 3, 1, 32}), "out: is not aligned to 4 bytes");
  refused(write({data, k, 2, 1, 32}), "out: the rows of the completed frame overlap each other");
  refused(mask({nullptr, k, 1}), "known: is a null pointer");
  refused(mask({nullptr, -2, 1}), "known: cannot have -2 rows");

  std::vector<float> far = mesh.vertices;
  far[3] = 1e19F;
  refused(push(in(far)),
          "points: row 1 is at (9.99999998e+18, 0, 0.193265304), but known positions must be "
          "finite and below 1e18");

  const std::vector<Index> indices = {5, 3, 5};
  const dynmesh_points three = {mesh.vertices.data(), 3, 3, 1, 32};
  const auto sparse = [&](const std::int32_t* of, std::int64_t n) {
    return dynmesh_push_sparse(c, of, n, &three, &output, nullptr);
  };
  refused(sparse(indices.data(), 3), "indices: vertex 5 is listed twice, at positions 0 and 2");
  refused(sparse(indices.data(), 2), "points: has 3 rows for 2 indices");
  refused(sparse(indices.data(), -3), "indices: cannot have -3 rows");
  refused(sparse(nullptr, 3), "indices: is a null pointer");
  refused(dynmesh_push_sparse(nullptr, indices.data(), 3, &three, &output, nullptr),
          "completer: is a null pointer");
  refused(dynmesh_push_sparse(c, indices.data(), 3, nullptr, &output, nullptr),
          "points: is a null pointer");
  refused(dynmesh_push_sparse(c, indices.data(), 3, &three, nullptr, nullptr),
          "out: is a null pointer");
  refused(dynmesh_skip(nullptr, &output, nullptr), "completer: is a null pointer");
  refused(dynmesh_skip(c, nullptr, nullptr), "out: is a null pointer");
  refused(dynmesh_reset(nullptr, &points), "completer: is a null pointer");
  refused(dynmesh_reset(c, nullptr), "frame: is a null pointer");
  refused(dynmesh_reset(c, &three), "frame: has 3 rows, but the mesh has 16 vertices");

  std::vector<std::byte> room(before.size());
  const auto size = static_cast<std::int64_t>(before.size());
  refused(dynmesh_state(nullptr, room.data(), size), "completer: is a null pointer");
  refused(dynmesh_state(c, nullptr, size), "state: is a null pointer");
  refused(dynmesh_state(c, room.data(), size - 1),
          "state: has room for " + std::to_string(size - 1) + " bytes, but the state has " +
              std::to_string(size));
  CHECK(room == std::vector<std::byte>(before.size()));
  refused(dynmesh_restore(nullptr, before.data(), size), "completer: is a null pointer");
  refused(dynmesh_restore(c, nullptr, size), "state: is a null pointer");
  refused(dynmesh_restore(c, before.data(), -1), "state: cannot have -1 bytes");
  refused(dynmesh_restore(c, before.data(), size - 1),
          "state: truncated: its 587 bytes are too few");
  auto damaged = before;
  damaged[200] ^= std::byte{1};
  refused(dynmesh_restore(c, damaged.data(), size),
          "state: damaged: its 588 bytes do not match their checksum");

  std::int64_t face = 0;
  const char* reason = nullptr;
  dynmesh_topology_report topology{};
  dynmesh_frame_report report{};
  refused(dynmesh_refused_face(c, 0, &face, &reason),
          "number: is 0, but 0 faces were refused, counted from 0");
  refused(dynmesh_refused_face(c, -1, &face, &reason),
          "number: is -1, but 0 faces were refused, counted from 0");
  refused(dynmesh_refused_face(c, 0, nullptr, &reason), "face: is a null pointer");
  refused(dynmesh_refused_face(c, 0, &face, nullptr), "reason: is a null pointer");
  refused(dynmesh_refused_face(nullptr, 0, &face, &reason), "completer: is a null pointer");
  refused(dynmesh_topology(nullptr, &topology), "completer: is a null pointer");
  refused(dynmesh_topology(c, nullptr), "report: is a null pointer");
  refused(dynmesh_report(nullptr, &report), "completer: is a null pointer");
  refused(dynmesh_report(c, nullptr), "report: is a null pointer");
  CHECK(dynmesh_n_vertices(nullptr) == 0);
  std::int64_t unwritten = 7;
  refused(dynmesh_state_size(nullptr, &unwritten), "completer: is a null pointer");
  refused(dynmesh_state_size(c, nullptr), "size: is a null pointer");
  CHECK(unwritten == 7);
  CHECK(dynmesh_generation(nullptr) == nullptr);
  CHECK(dynmesh_age(nullptr) == nullptr);
  dynmesh_destroy(nullptr);
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
  points.row_stride = 0;
  points.column_stride = points.count;
  CHECK(dynmesh_reset(twins.handle.get(), &points) == DYNMESH_INVALID_ARGUMENT);
  CHECK(std::string(dynmesh_last_message()) ==
        "frame: row_stride is 0, which means packed, but column_stride is " +
            std::to_string(points.count) + ", not 1 or 0");
}

TEST_CASE("settings of another size are refused") {
  const Mesh<float> mesh = sheet<float>(3);
  const auto frame = in(mesh.vertices);
  const auto n_faces = static_cast<std::int64_t>(mesh.faces().count);
  dynmesh_settings untouched{};
  untouched.threads = 7;
  for (const std::int64_t size : {0, 32, 39, 41, 48, -1}) {
    const std::string reason = "is " + std::to_string(size) +
                               ", but this version of dynmesh expects settings of 40 bytes; "
                               "call dynmesh_default_settings first";
    dynmesh_settings settings = untouched;
    CHECK(dynmesh_default_settings(&settings, size) == DYNMESH_INVALID_ARGUMENT);
    CHECK(std::string(dynmesh_last_message()) == "size: " + reason);
    CHECK(std::memcmp(&settings, &untouched, sizeof settings) == 0);
    REQUIRE(dynmesh_default_settings(&settings, sizeof settings) == DYNMESH_OK);
    CHECK(settings.size == sizeof settings);
    settings.size = size;
    dynmesh_completer* completer = nullptr;
    CHECK(dynmesh_create(mesh.indices.data(), n_faces, &frame, &settings, &completer) ==
          DYNMESH_INVALID_ARGUMENT);
    CHECK(completer == nullptr);
    CHECK(std::string(dynmesh_last_message()) == "settings.size: " + reason);
  }
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

TEST_CASE("a completer is not created from bad input") {
  const Mesh<double> mesh = sheet<double>(3);
  const auto n_faces = static_cast<std::int64_t>(mesh.faces().count);
  const auto frame = in(mesh.vertices);
  const auto refused = [&](const std::int32_t* faces, std::int64_t n, const dynmesh_points* first,
                           const dynmesh_settings* settings, const std::string& message) {
    dynmesh_completer* completer = reinterpret_cast<dynmesh_completer*>(1);
    CHECK(dynmesh_create(faces, n, first, settings, &completer) == DYNMESH_INVALID_ARGUMENT);
    CHECK(completer == nullptr);
    CHECK(std::string(dynmesh_last_message()) == message);
  };
  const auto* const faces = mesh.indices.data();
  refused(nullptr, n_faces, &frame, nullptr, "faces: is a null pointer");
  refused(faces, -1, &frame, nullptr, "faces: cannot have -1 rows");
  refused(faces, 0, &frame, nullptr,
          "faces: is empty; completion needs the connectivity of the mesh");
  refused(faces, n_faces, nullptr, nullptr, "first_frame: is a null pointer");
  auto changed = frame;
  changed.type = 16;
  refused(faces, n_faces, &changed, nullptr,
          "first_frame: type must be DYNMESH_FLOAT32 (32) or DYNMESH_FLOAT64 (64), not 16");
  changed = frame;
  changed.count = 0;
  refused(faces, n_faces, &changed, nullptr, "first_frame: has no vertices");
  changed.count = std::numeric_limits<std::int64_t>::min();
  refused(faces, n_faces, &changed, nullptr, "first_frame: cannot have -9223372036854775808 rows");
  changed = frame;
  changed.data = nullptr;
  refused(faces, n_faces, &changed, nullptr, "first_frame: is a null pointer");

  const auto setting = [&](auto change, const std::string& message) {
    dynmesh_settings settings{};
    CHECK(dynmesh_default_settings(&settings, sizeof settings) == DYNMESH_OK);
    change(settings);
    refused(faces, n_faces, &frame, &settings, message);
  };
  setting([](auto& s) { s.method = 7; },
          "method: must be DYNMESH_METHOD_MOTION (0) or DYNMESH_METHOD_DETAIL (1), not 7");
  setting([](auto& s) { s.unseen = -1; },
          "unseen: must be DYNMESH_UNSEEN_HOLD (0) or DYNMESH_UNSEEN_FOLLOW (1), not -1");
  setting([](auto& s) { s.extra_iterations = -1; },
          "extra_iterations: must be from 0 to 1000000, not -1");
  setting([](auto& s) { s.threads = 0; }, "threads: must be from 1 to 256, not 0");
  setting([](auto& s) { s.noise = 0; }, "noise: requires method='detail'");
  setting([](auto& s) { s.reject_outliers = 1; }, "reject_outliers: requires method='detail'");

  CHECK(dynmesh_create(faces, n_faces, &frame, nullptr, nullptr) == DYNMESH_INVALID_ARGUMENT);
  CHECK(dynmesh_default_settings(nullptr, sizeof(dynmesh_settings)) == DYNMESH_INVALID_ARGUMENT);
  CHECK(std::string(dynmesh_last_message()) == "settings: is a null pointer");
}

TEST_CASE("each thread has its own last message, which successful calls keep") {
  CHECK(dynmesh_default_settings(nullptr, sizeof(dynmesh_settings)) == DYNMESH_INVALID_ARGUMENT);
  std::string elsewhere = "?";
  std::thread([&] { elsewhere = dynmesh_last_message(); }).join();
  CHECK(elsewhere.empty());
  const Handle handle = create(sheet<float>(3));
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
  const std::string long_name(2000, 'x');
  CHECK(dynmesh_read_template(long_name.c_str(), &mesh) == DYNMESH_UNREADABLE_FILE);
  CHECK(std::string(dynmesh_last_message()) == std::string(1023, 'x'));
  CHECK(dynmesh_read_template(nullptr, &mesh) == DYNMESH_INVALID_ARGUMENT);
  CHECK(dynmesh_read_template(path.c_str(), nullptr) == DYNMESH_INVALID_ARGUMENT);
  std::filesystem::remove_all(folder);
}

TEST_CASE("a C program compiles, links and runs") { CHECK(run_c_program() == 0); }

}  // namespace
}  // namespace dynmesh::testing
