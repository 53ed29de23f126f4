/// The tracker in the C interface.
#include <dynmesh/dynmesh.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <dynmesh/tracker.hpp>
#include <dynmesh/training.hpp>
#include <dynmesh/types.hpp>
#include <stdexcept>
#include <string>

#include "c/arguments.hpp"
#include "c/depth_images.hpp"
#include "c/handles.hpp"
#include "c/status.hpp"
#include "c/stream.hpp"

using namespace dynmesh;  // C has no namespaces

dynmesh_status dynmesh_tracker_create(const int32_t* faces, int64_t n_faces,
                                      const dynmesh_points* first_frame, int32_t threads,
                                      dynmesh_tracker** tracker) {
  return dynmesh_tracker_create_with(faces, n_faces, first_frame, threads, 0, 0, nullptr, tracker);
}

dynmesh_status dynmesh_tracker_create_with(const int32_t* faces, int64_t n_faces,
                                           const dynmesh_points* first_frame, int32_t threads,
                                           int32_t uncertainty, int32_t recover,
                                           dynmesh_training* training, dynmesh_tracker** tracker) {
  const TrackerSettings settings = {
      .threads = threads, .uncertainty = uncertainty != 0, .recover = recover != 0};
  const dynmesh_status status = guarded([&] {
    check_pointer("tracker", tracker);
    *tracker = nullptr;
    check_pointer("first_frame", first_frame);
    if (training != nullptr) return;
    with_type_of("first_frame", first_frame, [&]<class Real>(Points<const Real> frame) {
      *tracker = new dynmesh_tracker{Tracker<Real>(faces_of(faces, n_faces), frame, settings)};
    });
  });
  if (status != DYNMESH_OK || training == nullptr) return status;
  return with(training, [&]<class Real>(const Training<Real>& frames) {
    const auto frame = points_of<const Real>("first_frame", first_frame, "the training sequence");
    *tracker =
        new dynmesh_tracker{Tracker<Real>(faces_of(faces, n_faces), frame, settings, frames)};
  });
}

void dynmesh_tracker_destroy(dynmesh_tracker* tracker) { delete tracker; }

dynmesh_status dynmesh_tracker_push(dynmesh_tracker* tracker, const dynmesh_points* points,
                                    const dynmesh_points* normals, const dynmesh_points* viewpoints,
                                    const dynmesh_output* out, dynmesh_tracking_report* report) {
  return with(tracker, [&]<class Real>(Tracker<Real>& t) {
    Scan<Real> scan;
    scan.points = points_of<const Real>("points", points);
    if (normals != nullptr) scan.normals = points_of<const Real>("normals", normals);
    if (viewpoints != nullptr) scan.viewpoints = points_of<const Real>("viewpoints", viewpoints);
    store(t.push(scan, points_of<Real>("out", out)), report);
  });
}

dynmesh_status dynmesh_tracker_push_depth(dynmesh_tracker* tracker,
                                          const dynmesh_depth_image* images, int64_t n_images,
                                          const dynmesh_output* out,
                                          dynmesh_tracking_report* report) {
  return with(tracker, [&]<class Real>(Tracker<Real>& t) {
    store(t.push_depth(images_of(images, n_images), points_of<Real>("out", out)), report);
  });
}

dynmesh_status dynmesh_tracker_skip(dynmesh_tracker* tracker, const dynmesh_output* out,
                                    dynmesh_tracking_report* report) {
  return skip(tracker, out, report);
}

dynmesh_status dynmesh_tracker_reset(dynmesh_tracker* tracker, const dynmesh_points* frame) {
  return reset(tracker, frame);
}

dynmesh_status dynmesh_tracker_state_size(const dynmesh_tracker* tracker, int64_t* size) {
  return state_size(tracker, size);
}

dynmesh_status dynmesh_tracker_state(const dynmesh_tracker* tracker, void* state, int64_t size) {
  return write_state(tracker, state, size);
}

dynmesh_status dynmesh_tracker_restore(dynmesh_tracker* tracker, const void* state, int64_t size) {
  return restore(tracker, state, size);
}

const uint8_t* dynmesh_tracker_observed(const dynmesh_tracker* tracker) {
  return data_of(tracker, [](const auto& t) { return t.observed(); });
}

const int32_t* dynmesh_tracker_generation(const dynmesh_tracker* tracker) {
  return generation(tracker);
}

const int32_t* dynmesh_tracker_age(const dynmesh_tracker* tracker) { return age(tracker); }

dynmesh_status dynmesh_tracker_agreement_of_sensors(const dynmesh_tracker* tracker,
                                                    dynmesh_agreement* values, int64_t count,
                                                    int64_t* n_sensors) {
  return with(tracker, [&](const auto& t) {
    check_pointer("n_sensors", n_sensors);
    if (count < 0) throw std::invalid_argument("count: is " + std::to_string(count));
    if (count > 0) check_pointer("values", values);
    const auto found = t.agreement_of_sensors();
    const auto n = std::min(found.size(), static_cast<std::size_t>(count));
    std::ranges::transform(found.first(n), values, [](const auto& one) { return to_c(one); });
    *n_sensors = static_cast<int64_t>(found.size());
  });
}

dynmesh_status dynmesh_tracker_standard_error(const dynmesh_tracker* tracker, void* values,
                                              int64_t count, int32_t type) {
  return standard_error(tracker, values, count, type);
}
