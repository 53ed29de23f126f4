/// The tracker in the C interface.
#include <dynmesh/dynmesh.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <dynmesh/tracker.hpp>
#include <dynmesh/training.hpp>
#include <dynmesh/types.hpp>
#include <string>
#include <vector>

#include "c/arguments.hpp"
#include "c/handles.hpp"
#include "c/status.hpp"

namespace dynmesh {
namespace {

void store(const TrackingReport& report, dynmesh_tracking_report* where) {
  if (where == nullptr) return;
  *where = {static_cast<std::int64_t>(report.known),
            static_cast<std::int64_t>(report.filled),
            static_cast<std::int64_t>(report.disconnected),
            static_cast<std::int64_t>(report.iterations),
            report.aligned ? 1 : 0,
            report.distance,
            report.seconds};
}

template <class Real>
dynmesh_tracker* create_tracker(Faces faces, const dynmesh_points* first_frame,
                                const TrackerSettings& settings) {
  const auto frame = points_of<const Real>("first_frame", first_frame);
  return new dynmesh_tracker{Tracker<Real>(faces, frame, settings)};
}

template <class Real>
dynmesh_tracker* create_trained_tracker(Faces faces, const dynmesh_points* first_frame,
                                        const TrackerSettings& settings,
                                        const Training<Real>& training) {
  const auto frame = points_of<const Real>("first_frame", first_frame, "the training sequence");
  return new dynmesh_tracker{Tracker<Real>(faces, frame, settings, training)};
}

std::size_t side_of(std::size_t number, const char* side, std::int64_t value) {
  if (value < 0) {
    refuse("images", "image " + std::to_string(number) + " cannot have a " + side + " of " +
                         std::to_string(value));
  }
  return static_cast<std::size_t>(value);
}

DepthImage image_of(std::size_t number, const dynmesh_depth_image& given) {
  DepthImage image;
  image.data = given.data;
  image.height = side_of(number, "height", given.height);
  image.width = side_of(number, "width", given.width);
  const bool is_packed = given.row_stride == 0;
  image.row_stride = static_cast<std::ptrdiff_t>(is_packed ? given.width : given.row_stride);
  image.column_stride =
      static_cast<std::ptrdiff_t>(is_packed || given.column_stride == 0 ? 1 : given.column_stride);
  std::ranges::copy(given.intrinsics, image.intrinsics.begin());
  std::ranges::copy(given.pose, image.pose.begin());
  return image;
}

}  // namespace
}  // namespace dynmesh

using namespace dynmesh;

dynmesh_status dynmesh_tracker_create(const int32_t* faces, int64_t n_faces,
                                      const dynmesh_points* first_frame, int32_t threads,
                                      dynmesh_tracker** tracker) {
  return dynmesh_tracker_create_with(faces, n_faces, first_frame, threads, 0, nullptr, tracker);
}

dynmesh_status dynmesh_tracker_create_with(const int32_t* faces, int64_t n_faces,
                                           const dynmesh_points* first_frame, int32_t threads,
                                           int32_t uncertainty, dynmesh_training* training,
                                           dynmesh_tracker** tracker) {
  const TrackerSettings settings = {.threads = threads, .uncertainty = uncertainty != 0};
  const dynmesh_status status = guarded([&] {
    check_pointer("tracker", tracker);
    *tracker = nullptr;
    check_pointer("first_frame", first_frame);
    if (training != nullptr) return;
    const Faces triangles = faces_of(faces, n_faces);
    if (first_frame->type == DYNMESH_FLOAT32) {
      *tracker = create_tracker<float>(triangles, first_frame, settings);
    } else if (first_frame->type == DYNMESH_FLOAT64) {
      *tracker = create_tracker<double>(triangles, first_frame, settings);
    } else {
      refuse("first_frame", std::string("type must be ") + known_types + ", not " +
                                std::to_string(first_frame->type));
    }
  });
  if (status != DYNMESH_OK || training == nullptr) return status;
  return with(training, [&](const auto& frames) {
    *tracker = create_trained_tracker(faces_of(faces, n_faces), first_frame, settings, frames);
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
    const std::size_t count = count_of("images", n_images);
    if (count > 0) check_pointer("images", images);
    std::vector<DepthImage> converted(count);
    for (std::size_t i = 0; i < count; ++i) converted[i] = image_of(i, images[i]);
    store(t.push_depth(converted, points_of<Real>("out", out)), report);
  });
}

dynmesh_status dynmesh_tracker_skip(dynmesh_tracker* tracker, const dynmesh_output* out,
                                    dynmesh_tracking_report* report) {
  return with(tracker, [&]<class Real>(Tracker<Real>& t) {
    store(t.skip(points_of<Real>("out", out)), report);
  });
}

dynmesh_status dynmesh_tracker_reset(dynmesh_tracker* tracker, const dynmesh_points* frame) {
  return with(tracker, [&]<class Real>(Tracker<Real>& t) {
    t.reset(points_of<const Real>("frame", frame));
  });
}

dynmesh_status dynmesh_tracker_state_size(const dynmesh_tracker* tracker, int64_t* size) {
  return with_constant(tracker, [&](const auto& t) {
    check_pointer("size", size);
    *size = static_cast<int64_t>(t.state_size());
  });
}

dynmesh_status dynmesh_tracker_state(const dynmesh_tracker* tracker, void* state, int64_t size) {
  return with(tracker, [&](const auto& t) { write_state(t, state, size); });
}

dynmesh_status dynmesh_tracker_restore(dynmesh_tracker* tracker, const void* state, int64_t size) {
  return with(tracker, [&](auto& t) { read_state(t, state, size); });
}

const uint8_t* dynmesh_tracker_observed(const dynmesh_tracker* tracker) {
  const uint8_t* observed = nullptr;
  (void)with(tracker, [&](const auto& t) { observed = t.observed().data(); });
  return observed;
}

const int32_t* dynmesh_tracker_generation(const dynmesh_tracker* tracker) {
  const int32_t* generation = nullptr;
  (void)with(tracker, [&](const auto& t) { generation = t.generation().data(); });
  return generation;
}

const int32_t* dynmesh_tracker_age(const dynmesh_tracker* tracker) {
  const int32_t* age = nullptr;
  (void)with(tracker, [&](const auto& t) { age = t.age().data(); });
  return age;
}

dynmesh_status dynmesh_tracker_standard_error(const dynmesh_tracker* tracker, void* values,
                                              int64_t count, int32_t type) {
  return with(tracker, [&](const auto& t) { write_standard_error(t, values, count, type); });
}
