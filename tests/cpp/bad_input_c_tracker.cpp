/// Cases of trackers in the C interface that Python cannot give, as in bad_input_c.cpp.
#include <dynmesh/dynmesh.h>

#include <cstddef>
#include <limits>

#include "bad_input.hpp"

namespace dynmesh::testing {

void try_c_tracker(World& world) {
  const auto k = static_cast<std::int64_t>(world.k);
  const auto n_faces = static_cast<std::int64_t>(world.mesh.faces().count);
  const std::int32_t* faces = world.mesh.indices.data();
  const dynmesh_points frame = {world.mesh.vertices.data(), k, 3, 1, DYNMESH_FLOAT64};
  dynmesh_tracker* t = nullptr;
  if (dynmesh_tracker_create(faces, n_faces, &frame, 1, &t) != DYNMESH_OK) ++faults();
  const auto state_of = [&] {
    std::int64_t size = 0;
    dynmesh_tracker_state_size(t, &size);
    std::vector<std::byte> state(static_cast<std::size_t>(size));
    dynmesh_tracker_state(t, state.data(), size);
    return state;
  };
  const auto before = state_of();
  const auto size = static_cast<std::int64_t>(before.size());
  const auto untouched = world.written;
  const auto tried = [&](const char* call, const char* given, Names names, dynmesh_status status) {
    const std::string answer = status == DYNMESH_OK ? "" : dynmesh_last_message();
    show("C", call, given, answer.empty() ? "" : std::to_string(status) + ", " + answer, names);
    if (status != DYNMESH_INVALID_ARGUMENT) {
      fault(call, given, "has the status " + std::to_string(status));
    }
    if (state_of() != before) fault(call, given, "changed the tracker");
    if (world.written != untouched) fault(call, given, "wrote to its output");
  };
  const char* create = "dynmesh_tracker_create";
  const auto made = [&](const dynmesh_points* first, std::int32_t threads) {
    dynmesh_tracker* other = t;
    const dynmesh_status status = dynmesh_tracker_create(faces, n_faces, first, threads, &other);
    if (other != nullptr) fault(create, "bad input", "left the handle as it was");
    return status;
  };
  dynmesh_tracker* another = nullptr;
  try_nulls(tried, create, dynmesh_tracker_create,
            {nullptr, nullptr, "first_frame", nullptr, "tracker"}, faces, n_faces, &frame, 1,
            &another);
  dynmesh_points typeless = frame;
  typeless.type = 16;
  tried(create, "`type = 16`", {"first_frame:", "16"}, made(&typeless, 1));
  tried(create, "`threads = 0`", {"threads", "0"}, made(&frame, 0));

  const char* push = "dynmesh_tracker_push";
  const dynmesh_output out = {world.written.data(), k, 3, 1, DYNMESH_FLOAT64};
  const auto pushed = [&](const dynmesh_points* points, const dynmesh_points* normals,
                          const dynmesh_output* to) {
    return dynmesh_tracker_push(t, points, normals, nullptr, to, nullptr);
  };
  try_nulls(tried, push, dynmesh_tracker_push,
            {"tracker", "points", nullptr, nullptr, "out", nullptr}, t, &frame, nullptr, nullptr,
            &out, nullptr);
  dynmesh_points fewer = frame;
  fewer.count = k - 1;
  tried(push, "`normals`: one row too few", {"normals:", "48", "49"}, pushed(&frame, &fewer, &out));
  dynmesh_points single = frame;
  single.type = DYNMESH_FLOAT32;
  tried(push, "`points`: of the other type", {"points:", "type"}, pushed(&single, nullptr, &out));
  dynmesh_points negative = frame;
  negative.count = -1;
  tried(push, "`points`: a count of -1", {"points:", "-1"}, pushed(&negative, nullptr, &out));

  const char* push_depth = "dynmesh_tracker_push_depth";
  const std::vector<float> pixels(20, 1.0F);
  dynmesh_depth_image image = {pixels.data(), 4, 5, 0, 0, {4, 0, 2, 0, 4, 2, 0, 0, 1}, {}};
  for (const int e : {0, 5, 10, 15}) image.pose[e] = 1;
  const auto seen = [&](const dynmesh_depth_image& view, std::int64_t n = 1) {
    return dynmesh_tracker_push_depth(t, &view, n, &out, nullptr);
  };
  try_nulls(tried, push_depth, dynmesh_tracker_push_depth,
            {nullptr, "images", nullptr, nullptr, nullptr}, t, &image, 1, &out, nullptr);
  tried(push_depth, "`n_images = -1`", {"images", "-1"}, seen(image, -1));
  dynmesh_depth_image bad = image;
  bad.width = -5;
  tried(push_depth, "`width = -5`", {"-5"}, seen(bad));

  const char* find = "dynmesh_find_alignment";
  dynmesh_alignment alignment{};
  const auto aligned = [&](const dynmesh_points* first, const dynmesh_points* scan) {
    return dynmesh_find_alignment(faces, n_faces, first, scan, &alignment);
  };
  try_nulls(tried, find, dynmesh_find_alignment,
            {nullptr, nullptr, "first_frame", "scan", "alignment"}, faces, n_faces, &frame, &frame,
            &alignment);
  tried(find, "`scan`: of the other type", {"scan:", "type"}, aligned(&frame, &single));
  if (alignment.mean_edge != 0) fault(find, "bad input", "wrote to its output");

  const char* registration = "dynmesh_register";
  dynmesh_registration_request request{};
  request.faces = faces;
  request.n_faces = n_faces;
  request.positions = &frame;
  request.points = &frame;
  request.align = 1;
  request.threads = 1;
  const auto registered = [&](const dynmesh_registration_request& given) {
    return dynmesh_register(&given, &out, nullptr, nullptr, nullptr);
  };
  try_nulls(tried, registration, dynmesh_register,
            {"request", "vertices", nullptr, nullptr, nullptr}, &request, &out, nullptr, nullptr,
            nullptr);
  dynmesh_registration_request wrong = request;
  wrong.positions = nullptr;
  tried(registration, "`positions`: a null pointer", {"template:", "null pointer"},
        registered(wrong));
  wrong = request;
  wrong.points = nullptr;
  tried(registration, "neither points nor images", {"points:", "null pointer"}, registered(wrong));
  wrong = request;
  wrong.points = &single;
  tried(registration, "`points`: of the other type", {"points:", "type"}, registered(wrong));
  wrong = request;
  wrong.landmarks = &frame;
  tried(registration, "no `landmark_vertices`", {"landmark_vertices:", "null pointer"},
        registered(wrong));

  std::vector<std::byte> room(before.size());
  tried("dynmesh_tracker_state", "`size`: too small", {"state:", std::to_string(size - 1)},
        dynmesh_tracker_state(t, room.data(), size - 1));
  auto flipped = before;
  flipped[100] ^= std::byte{1};
  tried("dynmesh_tracker_restore", "`state`: a flipped bit", {"state:", "damaged"},
        dynmesh_tracker_restore(t, flipped.data(), size));
  try_nulls(tried, "dynmesh_tracker_restore", dynmesh_tracker_restore, {nullptr, "state", nullptr},
            t, before.data(), size);
  try_nulls(tried, "dynmesh_tracker_skip", dynmesh_tracker_skip, {nullptr, "out", nullptr}, t, &out,
            nullptr);
  double bar = 0;
  tried("dynmesh_tracker_standard_error", "without uncertainty", {"standard_error:", "uncertainty"},
        dynmesh_tracker_standard_error(t, &bar, k, DYNMESH_FLOAT64));
  const char* of_sensors = "dynmesh_tracker_agreement_of_sensors";
  dynmesh_agreement agreement{};
  std::int64_t n_sensors = 0;
  try_nulls(tried, of_sensors, dynmesh_tracker_agreement_of_sensors,
            {nullptr, "values", nullptr, "n_sensors"}, t, &agreement, 1, &n_sensors);
  tried(of_sensors, "`count = -1`", {"count:", "-1"},
        dynmesh_tracker_agreement_of_sensors(t, &agreement, -1, &n_sensors));
  if (dynmesh_tracker_observed(nullptr) != nullptr) {
    fault("dynmesh_tracker_observed", "a null pointer", "is not null");
  }
  dynmesh_tracker_destroy(t);
  dynmesh_tracker_destroy(nullptr);
}

}  // namespace dynmesh::testing
