/// Cases of the C interface that Python cannot give: the tables of Python show what both check.
#include <dynmesh/dynmesh.h>

#include <array>
#include <limits>

#include "bad_input.hpp"

namespace dynmesh::testing {

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
  const auto untouched = world.written;
  const auto tried = [&](const char* call, const char* given, Names names, dynmesh_status status,
                         dynmesh_status expected = DYNMESH_INVALID_ARGUMENT) {
    const std::string answer = status == DYNMESH_OK ? "" : dynmesh_last_message();
    show("C", call, given, answer.empty() ? "" : std::to_string(status) + ", " + answer, names);
    if (status != expected) fault(call, given, "has the status " + std::to_string(status));
    if (state_of() != before) fault(call, given, "changed the completer");
    if (world.written != untouched) fault(call, given, "wrote to its output");
  };
  // A refused call sets the handle to a null pointer.
  dynmesh_completer* other = nullptr;
  const auto make_of = [&](const std::int32_t* of, std::int64_t n, const dynmesh_points* first,
                           const dynmesh_settings* how) {
    other = c;
    const dynmesh_status status = dynmesh_create(of, n, first, how, &other);
    if (other != nullptr) fault("dynmesh_create", "bad input", "left the handle as it was");
    return status;
  };
  const auto make = [&](const dynmesh_points* first, const dynmesh_settings* how) {
    return make_of(faces, n_faces, first, how);
  };
  const auto set = [&](auto change) {
    dynmesh_settings changed = settings;
    change(changed);
    return make(&frame, &changed);
  };
  const dynmesh_settings zeros{};
  dynmesh_points typeless = frame;
  typeless.type = 16;
  dynmesh_points negative = frame;
  negative.count = -1;
  dynmesh_points misaligned = frame;
  misaligned.data = static_cast<const char*>(frame.data) + 1;
  dynmesh_points empty = frame;
  empty.count = 0;
  dynmesh_points nothing = frame;
  nothing.data = nullptr;
  dynmesh_settings larger = settings;
  larger.size += 8;
  try_nulls(tried, "dynmesh_default_settings", dynmesh_default_settings, {"settings", nullptr},
            &larger, sizeof larger);
  try_nulls(tried, "dynmesh_create", dynmesh_create,
            {"faces", nullptr, "first_frame", nullptr, "completer"}, faces, n_faces, &frame,
            &settings, &other);
  tried("dynmesh_default_settings", "`size`: 0", {"size:", "0", "48"},
        dynmesh_default_settings(&larger, 0));
  tried("dynmesh_create", "`n_faces`: -1", {"faces:", "-1"}, make_of(faces, -1, &frame, &settings));
  tried("dynmesh_create", "`first_frame`: type 16", {"first_frame:", "not 16"},
        make(&typeless, &settings));
  tried("dynmesh_create", "`first_frame`: count -1", {"first_frame:", "-1"},
        make(&negative, &settings));
  tried("dynmesh_create", "no faces", {"faces:", "is empty"}, make_of(faces, 0, &frame, &settings));
  tried("dynmesh_create", "`first_frame`: no vertex", {"first_frame:", "no vertices"},
        make(&empty, &settings));
  tried("dynmesh_create", "`first_frame`: data a null pointer", {"first_frame:", "null pointer"},
        make(&nothing, &settings));
  tried("dynmesh_create", "`first_frame`: misaligned", {"first_frame:", "8"},
        make(&misaligned, &settings));
  tried("dynmesh_create", "`settings`: all zeros", {"settings.size:", "48"}, make(&frame, &zeros));
  tried("dynmesh_create", "`settings`: method 7", {"method:", "not 7"},
        set([](auto& s) { s.method = 7; }));
  tried("dynmesh_create", "`settings`: disconnected -1", {"disconnected:", "0", "1", "-1"},
        set([](auto& s) { s.disconnected = -1; }));
  tried("dynmesh_create", "`settings`: of another size", {"settings.size:", "56", "48"},
        make(&frame, &larger));

  dynmesh_training* training = nullptr;
  dynmesh_training* other_training = nullptr;
  const auto training_of = [&](std::int64_t rows, std::int32_t type) {
    const auto status = dynmesh_training_create(rows, type, &other_training);
    if (other_training != nullptr) fault("dynmesh_training_create", "bad input", "made one");
    return status;
  };
  if (dynmesh_training_create(k, DYNMESH_FLOAT64, &training) != DYNMESH_OK) ++faults();
  try_nulls(tried, "dynmesh_training_create", dynmesh_training_create,
            {nullptr, nullptr, "training"}, k, DYNMESH_FLOAT64, nullptr);
  try_nulls(tried, "dynmesh_training_add", dynmesh_training_add, {"training", "frame"}, training,
            &frame);
  tried("dynmesh_training_create", "`n_vertices`: -1", {"n_vertices:", "not -1"},
        training_of(-1, DYNMESH_FLOAT64));
  tried("dynmesh_training_create", "`n_vertices`: 2^31", {"n_vertices:", "not 2147483648"},
        training_of(std::int64_t{1} << 31, DYNMESH_FLOAT64));
  tried("dynmesh_training_create", "`type`: 16", {"type:", "not 16"}, training_of(k, 16));
  const auto add = [&](const dynmesh_points& of) { return dynmesh_training_add(training, &of); };
  dynmesh_points float32 = frame;
  float32.type = DYNMESH_FLOAT32;
  tried("dynmesh_training_add", "`frame`: data a null pointer", {"frame 0:", "null pointer"},
        add(nothing));
  tried("dynmesh_training_add", "`frame`: of float32", {"frame:", "64", "training", "not 32"},
        add(float32));
  tried("dynmesh_training_add", "`frame`: no rows", {"frame 0:", "0 rows", "49"}, add(empty));
  dynmesh_settings detail = settings;
  detail.method = DYNMESH_METHOD_DETAIL;
  const auto make_trained = [&](const dynmesh_settings* how, const dynmesh_points* first,
                                dynmesh_training* from) {
    other = c;
    const auto status = dynmesh_create_trained(faces, n_faces, first, how, from, &other);
    if (other != nullptr) {
      fault("dynmesh_create_trained", "bad input", "left the handle as it was");
    }
    return status;
  };
  for (int n = 0; n < 3; ++n) {
    if (add(frame) != DYNMESH_OK) ++faults();
  }
  try_nulls(tried, "dynmesh_create_trained", dynmesh_create_trained,
            {nullptr, nullptr, "first_frame", nullptr, "training", "completer"}, faces, n_faces,
            &frame, &detail, training, &other);
  tried("dynmesh_create_trained", "`first_frame`: of float32",
        {"first_frame:", "64", "training", "not 32"}, make_trained(&detail, &float32, training));
  tried("dynmesh_create_trained", "`n_faces`: -1", {"faces:", "-1"},
        dynmesh_create_trained(faces, -1, &frame, &detail, training, &other));
  // It is as it was, and good.
  if (dynmesh_create_trained(faces, n_faces, &frame, &detail, training, &other) != DYNMESH_OK) {
    fault("dynmesh_create_trained", "good input", "was refused");
  }
  dynmesh_destroy(other);
  dynmesh_training_destroy(training);

  const dynmesh_points points = {world.given.data(), k, 3, 1, DYNMESH_FLOAT64};
  dynmesh_points single = points;
  single.type = DYNMESH_FLOAT32;
  const dynmesh_mask known = {world.seen.data(), k, 1};
  const dynmesh_mask null_mask = {nullptr, k, 1};
  const dynmesh_output out = {world.written.data(), k, 3, 1, DYNMESH_FLOAT64};
  const dynmesh_output nowhere = {nullptr, k, 3, 1, DYNMESH_FLOAT64};
  const dynmesh_points planar = {world.given.data(), k, 0, k, DYNMESH_FLOAT64};
  const std::array<std::int32_t, 2> twice = {4, 4};
  dynmesh_points two = points;
  two.count = 2;
  std::vector<std::byte> room(before.size());
  const auto size = static_cast<std::int64_t>(before.size());
  std::int64_t unwritten = 7;
  std::int64_t face = 0;
  float bar = 0;
  const char* reason = nullptr;
  dynmesh_frame_report report{};
  dynmesh_topology_report topology{};
  const dynmesh_template* mesh = nullptr;
  try_nulls(tried, "dynmesh_push", dynmesh_push, {"completer", "points", nullptr, "out", nullptr},
            c, &points, &known, &out, nullptr);
  try_nulls(tried, "dynmesh_push_sparse", dynmesh_push_sparse,
            {"completer", "indices", nullptr, "points", "out", nullptr}, c, twice.data(), 2, &two,
            &out, nullptr);
  try_nulls(tried, "dynmesh_skip", dynmesh_skip, {"completer", "out", nullptr}, c, &out, nullptr);
  try_nulls(tried, "dynmesh_reset", dynmesh_reset, {"completer", "frame"}, c, &points);
  try_nulls(tried, "dynmesh_state_size", dynmesh_state_size, {"completer", "size"}, c, &unwritten);
  try_nulls(tried, "dynmesh_state", dynmesh_state, {"completer", "state", nullptr}, c, room.data(),
            size);
  try_nulls(tried, "dynmesh_restore", dynmesh_restore, {"completer", "state", nullptr}, c,
            before.data(), size);
  try_nulls(tried, "dynmesh_standard_error", dynmesh_standard_error,
            {"completer", "values", nullptr, nullptr}, c, &bar, k, DYNMESH_FLOAT32);
  try_nulls(tried, "dynmesh_report", dynmesh_report, {"completer", "report"}, c, &report);
  try_nulls(tried, "dynmesh_topology", dynmesh_topology, {"completer", "report"}, c, &topology);
  try_nulls(tried, "dynmesh_refused_face", dynmesh_refused_face,
            {"completer", nullptr, "face", "reason"}, c, 0, &face, &reason);
  try_nulls(tried, "dynmesh_read_template", dynmesh_read_template, {"path", nullptr}, "none.obj",
            &mesh);
  tried("dynmesh_push", "`points`: of float32", {"points:", "64", "32"},
        dynmesh_push(c, &single, &known, &out, nullptr));
  tried("dynmesh_push", "`known`: data a null pointer", {"known:", "null pointer"},
        dynmesh_push(c, &points, &null_mask, &out, nullptr));
  tried("dynmesh_push", "`out`: data a null pointer", {"out:", "null pointer"},
        dynmesh_push(c, &points, &known, &nowhere, nullptr));
  tried("dynmesh_push", "`points`: planar, row_stride 0", {"points: row_stride", "0", "49"},
        dynmesh_push(c, &planar, &known, &out, nullptr));
  const auto push = [&](const dynmesh_points& of) {
    return dynmesh_push(c, &of, &known, &out, nullptr);
  };
  const auto write = [&](const dynmesh_output& to) {
    return dynmesh_push(c, &points, &known, &to, nullptr);
  };
  const void* const askew = static_cast<const char*>(points.data) + 1;
  void* const askew_out = static_cast<char*>(out.data) + 1;
  constexpr std::int64_t huge = std::numeric_limits<std::int64_t>::max();
  const dynmesh_mask negative_mask = {world.seen.data(), -2, 1};
  tried("dynmesh_push", "`points`: data a null pointer", {"points:", "null pointer"},
        push({nullptr, k, 3, 1, 64}));
  tried("dynmesh_push", "`points`: count -1", {"points:", "-1"}, push({points.data, -1, 3, 1, 64}));
  tried("dynmesh_push", "`points`: count 2^63 - 1", {"points:", "9223372036854775807"},
        push({points.data, huge, 3, 1, 64}));
  tried("dynmesh_push", "`points`: type 0", {"points:", "not 0"}, push({points.data, k, 3, 1, 0}));
  tried("dynmesh_push", "`points`: misaligned", {"points:", "aligned", "8 bytes"},
        push({askew, k, 3, 1, 64}));
  tried("dynmesh_push", "`out`: count -5", {"out:", "-5"}, write({out.data, -5, 3, 1, 64}));
  tried("dynmesh_push", "`out`: of float32", {"out:", "64", "not 32"},
        write({out.data, k, 3, 1, 32}));
  tried("dynmesh_push", "`out`: misaligned", {"out:", "aligned", "8 bytes"},
        write({askew_out, k, 3, 1, 64}));
  tried("dynmesh_push", "`known`: count -2", {"known:", "-2"},
        dynmesh_push(c, &points, &negative_mask, &out, nullptr));
  tried("dynmesh_push_sparse", "`n_indices`: -1", {"indices:", "-1"},
        dynmesh_push_sparse(c, twice.data(), -1, &two, &out, nullptr));
  tried("dynmesh_reset", "`frame`: planar, row_stride 0", {"frame: row_stride", "0", "49"},
        dynmesh_reset(c, &planar));
  const std::string whole = std::to_string(size);
  const std::string cut = std::to_string(size - 1);
  tried("dynmesh_state", "`size`: too small", {"state:", cut, whole},
        dynmesh_state(c, room.data(), size - 1));
  tried("dynmesh_restore", "`size`: -1", {"state:", "-1"}, dynmesh_restore(c, before.data(), -1));
  tried("dynmesh_standard_error", "without uncertainty", {"standard_error:", "uncertainty"},
        dynmesh_standard_error(c, &bar, 49, DYNMESH_FLOAT32));
  tried("dynmesh_refused_face", "`number`: 0 of none", {"number:", "0"},
        dynmesh_refused_face(c, 0, &face, &reason));
  tried("dynmesh_read_template", "a file that is not there", {"none.obj:"},
        dynmesh_read_template("none.obj", &mesh), DYNMESH_UNREADABLE_FILE);
  tried("dynmesh_read_template", "`mesh`: a null pointer", {"null pointer"},
        dynmesh_read_template("none.obj", nullptr));
  if (mesh != nullptr) fault("dynmesh_read_template", "bad input", "made a template");
  if (room != std::vector<std::byte>(room.size()) || unwritten != 7 || face != 0) {
    fault("several calls", "bad input", "wrote to their results");
  }
  dynmesh_destroy(c);
}

}  // namespace dynmesh::testing
