/// Passes bad input to the C++ and the C interface and prints one line for each case: interface,
/// call, what is wrong, and the message, separated by tabs. The exit code is 1 if bad input was
/// accepted, gave no message, or changed a completer. docs/reference/bad_input.md is generated from
/// the output.
#include <dynmesh/dynmesh.h>

#include <array>
#include <cstdio>
#include <dynmesh/dynmesh.hpp>
#include <exception>
#include <functional>
#include <limits>
#include <string>
#include <vector>

#include "meshes.hpp"

using namespace dynmesh;
using namespace dynmesh::testing;

namespace {

/// The number of cases that failed.
int& faults() {
  static int count = 0;
  return count;
}

void show(const char* interface, const char* call, const char* given, const std::string& answer) {
  std::printf("%s\t%s\t%s\t%s\n", interface, call, given, answer.c_str());
  if (!answer.empty()) return;
  ++faults();
  std::fprintf(stderr, "%s, %s: was accepted\n", call, given);
}

/// A completer that has completed some frames, and valid arguments for its functions.
struct World {
  Mesh<double> mesh = sheet<double>(7);
  std::size_t k = mesh.size();
  std::vector<double> given = turned(mesh.vertices, 0.2);
  std::vector<double> written = std::vector<double>(3 * k);
  std::vector<std::uint8_t> seen = random_mask(k, 0.5, 1);
  Completer<double> completer{mesh.faces(), mesh.points()};

  Points<const double> points() { return {given.data(), k}; }
  KnownMask known() { return {seen.data(), k}; }
  Points<double> out() { return {written.data(), k}; }
};

void try_cpp(World& world) {
  constexpr auto none = static_cast<const double*>(nullptr);
  constexpr double nan = std::numeric_limits<double>::quiet_NaN();
  auto& c = world.completer;
  const std::size_t k = world.k;
  const auto tried = [&](const char* call, const char* given, const std::function<void()>& run) {
    const auto before = c.state();
    show("C++", call, given, message_of(run));
    if (c.state() == before) return;
    ++faults();
    std::fprintf(stderr, "%s, %s: changed the completer\n", call, given);
  };
  const auto with = [&](std::size_t index, double value) {
    auto changed = world.given;
    changed[index] = value;
    return changed;
  };

  const auto make = [&](Faces faces, Points<const double> frame, const Settings& settings = {}) {
    return [=] { (void)Completer<double>(faces, frame, settings); };
  };
  const auto faces = world.mesh.faces();
  const auto frame = world.mesh.points();
  const std::vector<Index> low = {0, 1, -1};
  const auto holed = with(13, nan);
  tried("Completer", "no faces", make({}, frame));
  tried("Completer", "`faces`: a null pointer", make({nullptr, 2}, frame));
  tried("Completer", "`faces`: 2^62 of them", make({faces.data, std::size_t{1} << 62}, frame));
  tried("Completer", "`faces`: an index of -1", make(faces_of(low), frame));
  tried("Completer", "`first_frame`: no vertex", make(faces, {none, 0}));
  tried("Completer", "`first_frame`: a null pointer", make(faces, {none, k}));
  tried("Completer", "`first_frame`: 2^62 rows",
        make(faces, {frame.data, std::size_t{1} << 62, 0, 0}));
  tried("Completer", "`first_frame`: one row too few", make(faces, {frame.data, k - 1}));
  tried("Completer", "`first_frame`: NaN in it", make(faces, {holed.data(), k}));
  tried("Completer", "`extra_iterations = -1`", make(faces, frame, {.extra_iterations = -1}));
  tried("Completer", "`threads = 0`", make(faces, frame, {.threads = 0}));
  tried("Completer", "`threads = 1000`", make(faces, frame, {.threads = 1000}));
  tried("Completer", "`noise = 0.1` by method motion", make(faces, frame, {.noise = 0.1}));
  tried("Completer", "`noise = NaN` by method detail",
        make(faces, frame, {.method = Method::detail, .noise = nan}));
  tried("Completer", "`revisit = false` by method detail",
        make(faces, frame, {.method = Method::detail, .revisit = false}));

  const auto infinite = with(13, std::numeric_limits<double>::infinity());
  const auto large = with(13, 1e201);
  const std::vector<std::uint8_t> all(k, 1);
  const KnownMask everything(all.data(), k);
  const auto push = [&](Points<const double> points, KnownMask known, Points<double> out) {
    return [=, &c] { c.push(points, known, out); };
  };
  const auto points = world.points();
  const auto known = world.known();
  const auto out = world.out();
  tried("push", "`points`: one row too few", push({points.data, k - 1}, known, out));
  tried("push", "`points`: a null pointer", push({none, k}, known, out));
  tried("push", "`points`: NaN, marked known", push({holed.data(), k}, everything, out));
  tried("push", "`points`: infinity, marked known", push({infinite.data(), k}, everything, out));
  tried("push", "`points`: 1e201", push({large.data(), k}, everything, out));
  tried("push", "`points`: a row stride of 0", push({points.data, k, 0}, known, out));
  tried("push", "`points`: a column stride of 0", push({points.data, k, 3, 0}, known, out));
  tried("push", "`known`: a stride of 0", push(points, {known.data, k, 0}, out));
  tried("push", "`known`: one row too few", push(points, {known.data, k - 1}, out));
  tried("push", "`known`: a null pointer",
        push(points, {static_cast<const std::uint8_t*>(nullptr), k}, out));
  tried("push", "`out`: one row too many", push(points, known, {out.data, k + 1}));
  tried("push", "`out`: a null pointer", push(points, known, {nullptr, k}));
  tried("push", "`out`: one row further than `points`",
        push({out.data, k - 1 + 1, 3, 1}, known, {out.data + 3, k}));
  tried("push", "`out`: rows that overlap", push(points, known, {out.data, k, 1, 1}));
  const auto sparse = [&](const std::vector<Index>& indices, Points<const double> observed) {
    return [=, &c] { c.push_sparse(indices, observed, out); };
  };
  tried("push_sparse", "`indices`: one twice", sparse({4, 7, 4}, {points.data, 3}));
  tried("push_sparse", "`indices`: one of k", sparse({4, 49}, {points.data, 2}));
  tried("push_sparse", "`indices`: a negative one", sparse({-1}, {points.data, 1}));
  tried("push_sparse", "`points`: fewer than indices", sparse({1, 2, 3}, {points.data, 2}));
  tried("push_sparse", "`points`: a null pointer", sparse({1}, {none, 1}));
  tried("skip", "`out`: one row too few", [&] { c.skip({out.data, k - 1}); });
  tried("reset", "`frame`: NaN in it", [&] { c.reset({holed.data(), k}); });
  tried("reset", "`frame`: one row too few", [&] { c.reset({points.data, k - 1}); });

  const auto state = c.state();
  const auto restore = [&](const std::vector<std::byte>& bytes) {
    return [=, &c] { c.restore(bytes); };
  };
  auto flipped = state;
  flipped[200] ^= std::byte{1};
  tried("restore", "`state`: empty", restore({}));
  tried("restore", "`state`: half of it", restore({state.begin(), state.begin() + 1000}));
  tried("restore", "`state`: a flipped bit", restore(flipped));
  tried("restore", "`state`: other bytes", restore(std::vector<std::byte>(3000)));
  tried("restore", "`state`: of another mesh",
        restore(Completer<double>(sheet<double>(5).faces(), sheet<double>(5).points()).state()));
  tried("restore", "`state`: of other settings",
        restore(Completer<double>(faces, frame, {.extra_iterations = 3}).state()));

  tried("build_topology", "`faces`: a null pointer", [] { build_topology({nullptr, 2}, 9); });
  tried("build_topology", "`n_vertices`: 2^40",
        [&] { build_topology(faces, std::size_t{1} << 40); });
  tried("read_template", "a file that is not there", [] { read_template("none.obj"); });
  tried("read_template", "another format", [] { read_template("body.npz"); });
  tried("method_from_name", "`lsm`", [] { method_from_name("lsm"); });
  tried("unseen_rule_from_name", "`x`", [] { unseen_rule_from_name("x"); });
  const Topology topology = build_topology(faces, k);
  LeastSquaresMesh rival(topology);
  tried("LeastSquaresMesh::complete", "nothing known", [&] {
    rival.complete(points, {std::vector<std::uint8_t>(k).data(), k}, {}, out);
  });
  tried("LeastSquaresMesh::complete", "`points`: a null pointer", [&] {
    rival.complete({none, k}, known, {}, out);
  });
  tried("LeastSquaresMesh::complete", "`completed`: one row too few", [&] {
    rival.complete(points, known, {}, {out.data, k - 1});
  });
  tried("nmsve", "`completed`: a null pointer", [&] {
    nmsve<double>(topology.cells, points, {none, k});
  });
  tried("nmsve", "`reference`: one row too few", [&] {
    nmsve<double>(topology.cells, {points.data, k - 1}, points);
  });
  tried("vertex_error", "`error`: one element too few", [&] {
    vertex_error<double>(points, points, {world.written.data(), k - 1});
  });
  tried("summary", "no error", [] { summary({}); });
}

void try_c(World& world) {
  dynmesh_settings settings{};
  dynmesh_default_settings(&settings, sizeof settings);
  const auto k = static_cast<std::int64_t>(world.k);
  const dynmesh_points frame = {world.mesh.vertices.data(), k, 3, 1, DYNMESH_FLOAT64};
  const auto n_faces = static_cast<std::int64_t>(world.mesh.faces().count);
  const std::int32_t* faces = world.mesh.indices.data();
  dynmesh_completer* c = nullptr;
  if (dynmesh_create(faces, n_faces, &frame, &settings, &c) != DYNMESH_OK) ++faults();
  const auto state_of = [&] {
    std::int64_t size = 0;
    dynmesh_state_size(c, &size);
    std::vector<std::byte> state(static_cast<std::size_t>(size));
    dynmesh_state(c, state.data(), static_cast<std::int64_t>(state.size()));
    return state;
  };
  const auto before = state_of();
  const auto tried = [&](const char* call, const char* given, dynmesh_status status) {
    const std::string answer = status == DYNMESH_OK ? "" : dynmesh_last_message();
    show("C", call, given, answer.empty() ? "" : std::to_string(status) + ", " + answer);
    if (state_of() == before) return;
    ++faults();
    std::fprintf(stderr, "%s, %s: changed the completer\n", call, given);
  };

  dynmesh_completer* other = nullptr;
  const auto make = [&](const dynmesh_points* first, const dynmesh_settings* how) {
    return dynmesh_create(faces, n_faces, first, how, &other);
  };
  const dynmesh_settings zeros{};
  dynmesh_points typeless = frame;
  typeless.type = 16;
  dynmesh_points negative = frame;
  negative.count = -1;
  dynmesh_points misaligned = frame;
  misaligned.data = static_cast<const char*>(frame.data) + 1;
  dynmesh_settings odd = settings;
  odd.method = 7;
  dynmesh_settings strange = settings;
  strange.unseen = -1;
  dynmesh_settings larger = settings;
  larger.size += 8;
  tried("dynmesh_default_settings", "`settings`: a null pointer",
        dynmesh_default_settings(nullptr, sizeof settings));
  tried("dynmesh_default_settings", "`size`: 0", dynmesh_default_settings(&larger, 0));
  tried("dynmesh_create", "`completer`: a null pointer",
        dynmesh_create(faces, n_faces, &frame, &settings, nullptr));
  tried("dynmesh_create", "`faces`: a null pointer",
        dynmesh_create(nullptr, n_faces, &frame, &settings, &other));
  tried("dynmesh_create", "`n_faces`: -1", dynmesh_create(faces, -1, &frame, &settings, &other));
  tried("dynmesh_create", "`first_frame`: a null pointer", make(nullptr, &settings));
  tried("dynmesh_create", "`first_frame`: type 16", make(&typeless, &settings));
  tried("dynmesh_create", "`first_frame`: count -1", make(&negative, &settings));
  tried("dynmesh_create", "`first_frame`: misaligned", make(&misaligned, &settings));
  tried("dynmesh_create", "`settings`: all zeros", make(&frame, &zeros));
  tried("dynmesh_create", "`settings`: method 7", make(&frame, &odd));
  tried("dynmesh_create", "`settings`: unseen -1", make(&frame, &strange));
  tried("dynmesh_create", "`settings`: of another size", make(&frame, &larger));

  const dynmesh_points points = {world.given.data(), k, 3, 1, DYNMESH_FLOAT64};
  dynmesh_points single = points;
  single.type = DYNMESH_FLOAT32;
  dynmesh_points few = points;
  few.count = k - 1;
  const dynmesh_mask known = {world.seen.data(), k, 1};
  const dynmesh_mask short_mask = {world.seen.data(), k - 1, 1};
  const dynmesh_mask null_mask = {nullptr, k, 1};
  const dynmesh_output out = {world.written.data(), k, 3, 1, DYNMESH_FLOAT64};
  const dynmesh_output nowhere = {nullptr, k, 3, 1, DYNMESH_FLOAT64};
  const dynmesh_output heap = {world.written.data(), k, 1, 1, DYNMESH_FLOAT64};
  const dynmesh_points planar = {world.given.data(), k, 0, k, DYNMESH_FLOAT64};
  tried("dynmesh_push", "`completer`: a null pointer",
        dynmesh_push(nullptr, &points, &known, &out, nullptr));
  tried("dynmesh_push", "`points`: a null pointer",
        dynmesh_push(c, nullptr, &known, &out, nullptr));
  tried("dynmesh_push", "`points`: of float32", dynmesh_push(c, &single, &known, &out, nullptr));
  tried("dynmesh_push", "`points`: one row too few", dynmesh_push(c, &few, &known, &out, nullptr));
  tried("dynmesh_push", "`known`: one row too few",
        dynmesh_push(c, &points, &short_mask, &out, nullptr));
  tried("dynmesh_push", "`known`: data a null pointer",
        dynmesh_push(c, &points, &null_mask, &out, nullptr));
  tried("dynmesh_push", "`out`: a null pointer",
        dynmesh_push(c, &points, &known, nullptr, nullptr));
  tried("dynmesh_push", "`out`: data a null pointer",
        dynmesh_push(c, &points, &known, &nowhere, nullptr));
  tried("dynmesh_push", "`points`: planar, row_stride 0",
        dynmesh_push(c, &planar, &known, &out, nullptr));
  tried("dynmesh_push", "`out`: rows that overlap",
        dynmesh_push(c, &points, &known, &heap, nullptr));
  const std::array<std::int32_t, 2> twice = {4, 4};
  dynmesh_points two = points;
  two.count = 2;
  tried("dynmesh_push_sparse", "`indices`: one twice",
        dynmesh_push_sparse(c, twice.data(), 2, &two, &out, nullptr));
  tried("dynmesh_push_sparse", "`indices`: a null pointer",
        dynmesh_push_sparse(c, nullptr, 2, &two, &out, nullptr));
  tried("dynmesh_push_sparse", "`n_indices`: -1",
        dynmesh_push_sparse(c, twice.data(), -1, &two, &out, nullptr));
  tried("dynmesh_skip", "`out`: a null pointer", dynmesh_skip(c, nullptr, nullptr));
  tried("dynmesh_reset", "`frame`: one row too few", dynmesh_reset(c, &few));
  std::vector<std::byte> room(before.size());
  const auto size = static_cast<std::int64_t>(before.size());
  tried("dynmesh_state_size", "`size`: a null pointer", dynmesh_state_size(c, nullptr));
  tried("dynmesh_state", "`size`: too small", dynmesh_state(c, room.data(), size - 1));
  tried("dynmesh_restore", "`state`: a null pointer", dynmesh_restore(c, nullptr, size));
  tried("dynmesh_restore", "`size`: -1", dynmesh_restore(c, before.data(), -1));
  tried("dynmesh_restore", "`size`: too small", dynmesh_restore(c, before.data(), size - 1));
  tried("dynmesh_report", "`report`: a null pointer", dynmesh_report(c, nullptr));
  std::int64_t face = 0;
  const char* reason = nullptr;
  tried("dynmesh_refused_face", "`number`: 0 of none", dynmesh_refused_face(c, 0, &face, &reason));
  const dynmesh_template* mesh = nullptr;
  tried("dynmesh_read_template", "`path`: a null pointer", dynmesh_read_template(nullptr, &mesh));
  tried("dynmesh_read_template", "a file that is not there",
        dynmesh_read_template("none.obj", &mesh));
  if (other != nullptr || mesh != nullptr) ++faults();
  dynmesh_destroy(c);
}

}  // namespace

int main() try {
  std::setvbuf(stdout, nullptr, _IOLBF, 0);
  World world;
  world.completer.push(world.points(), world.known(), world.out());
  try_cpp(world);
  try_c(world);
  return faults() == 0 ? 0 : 1;
} catch (const std::exception& error) {
  std::fprintf(stderr, "%s\n", error.what());
  return 1;
}
