/// The C interface: objects behind opaque handles.
#include <dynmesh/dynmesh.h>

#include <algorithm>
#include <dynmesh/completer.hpp>
#include <dynmesh/registration.hpp>
#include <dynmesh/template_mesh.hpp>
#include <dynmesh/tracker.hpp>
#include <dynmesh/training.hpp>
#include <limits>
#include <span>
#include <string>
#include <type_traits>
#include <utility>
#include <variant>
#include <vector>

#include "api/one_at_a_time.hpp"
#include "api/settings_table.hpp"
#include "base/checks.hpp"
#include "c/conversions.hpp"
#include "c/failures.hpp"

struct dynmesh_completer {
  static constexpr const char* name = "completer";
  std::variant<dynmesh::Completer<float>, dynmesh::Completer<double>> any;
  mutable dynmesh::OneAtATime turns{name};
};

struct dynmesh_training {
  static constexpr const char* name = "training";
  std::variant<dynmesh::Training<float>, dynmesh::Training<double>> any;
  dynmesh::OneAtATime turns{"training sequence"};
};

struct dynmesh_tracker {
  static constexpr const char* name = "tracker";
  std::variant<dynmesh::Tracker<float>, dynmesh::Tracker<double>> any;
  mutable dynmesh::OneAtATime turns{name};
};

namespace dynmesh {
namespace {

/// Calls `call` with the object in `handle`, of float or of double, for what any thread may do at
/// any time.
template <class Handle, class Call>
dynmesh_status at_any_time(Handle* handle, const Call& call) noexcept {
  return guarded([&] {
    check_pointer(Handle::name, handle);
    std::visit(call, handle->any);
  });
}

/// Calls `call` with the object in `handle`, of float or of double, for what only one thread may do
/// at a time. It is refused while another thread is using the object.
template <class Handle, class Call>
dynmesh_status with(Handle* handle, const Call& call) noexcept {
  return at_any_time(handle, [&](auto& object) { handle->turns.enter([&] { call(object); }); });
}

/// Calls `call` with positions, which are float or double as their type says, and a training
/// sequence of that type, or with null for none.
template <class Call>
void with_training(const char* argument, const dynmesh_points* positions,
                   dynmesh_training* training, const Call& call) {
  if (training != nullptr) {
    const auto of_that_type = [&]<class Real>(const Training<Real>& frames) {
      call(points_of<const Real>(argument, positions, "the training sequence"), &frames);
    };
    training->turns.enter([&] { std::visit(of_that_type, training->any); });
    return;
  }
  check_pointer(argument, positions);
  with_type(std::string(argument) + ": type", positions->type, [&]<class Real>(Real) {
    call(points_of<const Real>(argument, positions), static_cast<const Training<Real>*>(nullptr));
  });
}

using dynmesh::settings_of;
TrackerSettings settings_of(const TrackerSettings& settings) { return settings; }

/// Creates a completer or a tracker, with training unless that is null.
template <template <class> class Object, class Given, class Handle>
dynmesh_status create(const std::int32_t* faces, std::int64_t n_faces,
                      const dynmesh_points* first_frame, const Given& settings,
                      dynmesh_training* training, Handle** handle) {
  return guarded([&] {
    check_pointer(Handle::name, handle);
    *handle = nullptr;
    with_training("first_frame", first_frame, training,
                  [&]<class Real>(Points<const Real> frame, const Training<Real>* frames) {
                    const Faces mesh = faces_of(faces, n_faces);
                    const auto chosen = settings_of(settings);
                    *handle =
                        new Handle{frames == nullptr ? Object<Real>(mesh, frame, chosen)
                                                     : Object<Real>(mesh, frame, chosen, *frames)};
                  });
  });
}

void store(const FrameReport& report, dynmesh_frame_report* where) {
  *where = to_c<dynmesh_frame_report>(report);
}

void store(const TrackingReport& report, dynmesh_tracking_report* where) {
  const auto frame = to_c<dynmesh_frame_report>(static_cast<const FrameReport&>(report));
  *where = {frame.known,      frame.filled,     frame.disconnected,
            frame.iterations, report.recovered, measure_of(report.measure),
            frame.seconds};
}

/// Writes the frame that `call` returns the report of, and that report unless it is not wanted.
template <class Handle, class ReportInC, class Call>
dynmesh_status complete(Handle* handle, const dynmesh_output* out, ReportInC* report,
                        const Call& call) {
  return with(handle, [&]<template <class> class Object, class Real>(Object<Real>& object) {
    const auto found = call(object, [&] { return points_of<Real>("out", out); });
    if (report != nullptr) store(found, report);
  });
}

/// The data of an array of the last frame, which `get` returns; null without a valid handle.
template <class Handle, class Get>
auto data_of(const Handle* handle, const Get& get) {
  decltype(get(std::get<0>(handle->any)).data()) data = nullptr;
  (void)with(handle, [&](const auto& object) { data = get(object).data(); });
  return data;
}

/// The owner of the arrays to which a dynmesh_template points.
struct OwnedTemplate : dynmesh_template {
  explicit OwnedTemplate(TemplateMesh read) : dynmesh_template{}, mesh(std::move(read)) {
    vertices = mesh.vertices.data();
    n_vertices = static_cast<std::int64_t>(mesh.points().count);
    faces = mesh.faces.data();
    n_faces = static_cast<std::int64_t>(mesh.triangles().count);
  }
  TemplateMesh mesh;
};

/// Copies the positions of all vertices to the caller, and what else is wanted of each vertex.
template <class Real>
void give(const std::vector<Real>& found, Points<Real> positions,
          const std::vector<std::uint8_t>& flags, std::uint8_t* flags_out,
          const std::vector<Real>& standard_error, double* standard_error_out) {
  for (std::size_t v = 0; v < positions.count; ++v) {
    for (std::size_t c = 0; c < 3; ++c) positions(v, c) = found[3 * v + c];
  }
  if (flags_out != nullptr) std::ranges::copy(flags, flags_out);
  if (standard_error_out != nullptr) std::ranges::copy(standard_error, standard_error_out);
}

template <class Real>
Registration<Real> registered(const dynmesh_registration_request& request,
                              Points<const Real> positions, bool uncertainty,
                              const Training<Real>* training) {
  const auto optional = [](const char* argument, const dynmesh_points* view) {
    return view == nullptr ? Points<const Real>{}
                           : points_of<const Real>(argument, view, "the template");
  };
  Landmarks<Real> landmarks;
  landmarks.positions = optional("landmarks", request.landmarks);
  check_pointer("landmark_vertices", request.landmark_vertices, landmarks.positions.count);
  landmarks.vertices = {request.landmark_vertices, landmarks.positions.count};
  const RegistrationSettings settings = {request.align != 0, request.scale != 0, uncertainty,
                                         request.threads};
  const Faces faces = faces_of(request.faces, request.n_faces);
  if (request.points == nullptr && request.images != nullptr) {
    const auto images = images_of(request.images, request.n_images);
    return register_template<Real>(faces, positions, images, landmarks, settings, training);
  }
  const Scan<Real> scan = {points_of<const Real>("points", request.points, "the template"),
                           optional("normals", request.normals),
                           optional("viewpoints", request.viewpoints)};
  return register_template<Real>(faces, positions, scan, landmarks, settings, training);
}

}  // namespace
}  // namespace dynmesh

using namespace dynmesh;  // C has no namespaces

const char* dynmesh_version() { return DYNMESH_VERSION; }

// The functions that completers and trackers have in common, dynmesh_skip and so on.
#define DYNMESH_STREAM(prefix, Handle, Report)                                                  \
  void prefix##destroy(Handle* handle) { delete handle; }                                       \
  dynmesh_status prefix##skip(Handle* handle, const dynmesh_output* out, Report* report) {      \
    return complete(handle, out, report, [](auto& o, auto to) { return o.skip(to()); });        \
  }                                                                                             \
  dynmesh_status prefix##reset(Handle* handle, const dynmesh_points* frame) {                   \
    return with(handle, [&]<template <class> class Object, class Real>(Object<Real>& o) {       \
      o.reset(points_of<const Real>("frame", frame));                                           \
    });                                                                                         \
  }                                                                                             \
  dynmesh_status prefix##state_size(const Handle* handle, int64_t* size) {                      \
    return at_any_time(handle, [&](const auto& o) {                                             \
      check_pointer("size", size);                                                              \
      *size = static_cast<int64_t>(o.state_size());                                             \
    });                                                                                         \
  }                                                                                             \
  dynmesh_status prefix##state(const Handle* handle, void* state, int64_t size) {               \
    return with(handle, [&](const auto& o) {                                                    \
      check_pointer("state", state);                                                            \
      if (size < static_cast<int64_t>(o.state_size())) {                                        \
        refuse("state", "has room for ", size, " bytes, but the state has ", o.state_size());   \
      }                                                                                         \
      std::ranges::copy(o.state(), static_cast<std::byte*>(state));                             \
    });                                                                                         \
  }                                                                                             \
  dynmesh_status prefix##restore(Handle* handle, const void* state, int64_t size) {             \
    return with(handle, [&](auto& o) {                                                          \
      check_pointer("state", state);                                                            \
      if (size < 0) refuse("state", "cannot have ", size, " bytes");                            \
      o.restore({static_cast<const std::byte*>(state), static_cast<std::size_t>(size)});        \
    });                                                                                         \
  }                                                                                             \
  const int32_t* prefix##generation(const Handle* handle) {                                     \
    return data_of(handle, [](const auto& o) { return o.generation(); });                       \
  }                                                                                             \
  const int32_t* prefix##age(const Handle* handle) {                                            \
    return data_of(handle, [](const auto& o) { return o.age(); });                              \
  }                                                                                             \
  dynmesh_status prefix##standard_error(const Handle* handle, void* values, int64_t count,      \
                                        int32_t type) {                                         \
    return with(handle, [&]<template <class> class Object, class Real>(const Object<Real>& o) { \
      check_pointer("values", values);                                                          \
      const std::span<const Real> found = o.standard_error();                                   \
      if (count != static_cast<int64_t>(found.size())) {                                        \
        refuse("count", "is ", count, ", but the mesh has ", found.size(), " vertices");        \
      }                                                                                         \
      if (type != type_of<Real>) {                                                              \
        refuse("type", "must be ", type_of<Real>, ", that of the first frame, not ", type);     \
      }                                                                                         \
      std::ranges::copy(found, static_cast<Real*>(values));                                     \
    });                                                                                         \
  }
DYNMESH_STREAM(dynmesh_, dynmesh_completer, dynmesh_frame_report)
DYNMESH_STREAM(dynmesh_tracker_, dynmesh_tracker, dynmesh_tracking_report)
#undef DYNMESH_STREAM

dynmesh_status dynmesh_default_settings(dynmesh_settings* settings, int64_t size) {
  return guarded([&] {
    check_pointer("settings", settings);
    check_settings_size("size", size);
    const Settings defaults;
    settings->size = size;
    for_each_setting<Settings, dynmesh_settings>(
        [&](const Setting&, auto member, auto member_in_c) {
          if constexpr (std::is_same_v<decltype(member_in_c), double dynmesh_settings::*>) {
            settings->*member_in_c = (defaults.*member).value_or(std::nan(""));
          } else {
            settings->*member_in_c = static_cast<int32_t>(defaults.*member);
          }
        });
  });
}

dynmesh_status dynmesh_create(const int32_t* faces, int64_t n_faces,
                              const dynmesh_points* first_frame, const dynmesh_settings* settings,
                              dynmesh_completer** completer) {
  return create<Completer>(faces, n_faces, first_frame, settings, nullptr, completer);
}

dynmesh_status dynmesh_create_trained(const int32_t* faces, int64_t n_faces,
                                      const dynmesh_points* first_frame,
                                      const dynmesh_settings* settings, dynmesh_training* training,
                                      dynmesh_completer** completer) {
  if (completer != nullptr) *completer = nullptr;
  if (training == nullptr) return guarded([&] { check_pointer("training", training); });
  return create<Completer>(faces, n_faces, first_frame, settings, training, completer);
}

dynmesh_status dynmesh_tracker_create(const int32_t* faces, int64_t n_faces,
                                      const dynmesh_points* first_frame, int32_t threads,
                                      dynmesh_tracker** tracker) {
  return dynmesh_tracker_create_with(faces, n_faces, first_frame, threads, 0, 0, 0, nullptr,
                                     tracker);
}

dynmesh_status dynmesh_tracker_create_with(const int32_t* faces, int64_t n_faces,
                                           const dynmesh_points* first_frame, int32_t threads,
                                           int32_t uncertainty, int32_t recover, int32_t resolution,
                                           dynmesh_training* training, dynmesh_tracker** tracker) {
  const TrackerSettings settings = {.threads = threads,
                                    .uncertainty = uncertainty != 0,
                                    .recover = recover != 0,
                                    .resolution = resolution};
  return create<Tracker>(faces, n_faces, first_frame, settings, training, tracker);
}

dynmesh_status dynmesh_training_create(int64_t n_vertices, int32_t type,
                                       dynmesh_training** training) {
  return guarded([&] {
    check_pointer("training", training);
    *training = nullptr;
    if (n_vertices < 0 || n_vertices > std::numeric_limits<Index>::max()) {
      refuse("n_vertices", "must be from 0 to 2147483647, not ", n_vertices);
    }
    with_type("type", type, [&]<class Real>(Real) {
      *training = new dynmesh_training{Training<Real>(static_cast<std::size_t>(n_vertices))};
    });
  });
}

dynmesh_status dynmesh_training_add(dynmesh_training* training, const dynmesh_points* frame) {
  return with(training, [&]<class Real>(Training<Real>& frames) {
    frames.add(points_of<const Real>("frame", frame, "the training sequence"));
  });
}

void dynmesh_training_destroy(dynmesh_training* training) { delete training; }

dynmesh_status dynmesh_push(dynmesh_completer* completer, const dynmesh_points* points,
                            const dynmesh_mask* known, const dynmesh_output* out,
                            dynmesh_frame_report* report) {
  return complete(completer, out, report, [&]<class Real>(Completer<Real>& c, auto to) {
    const auto given = points_of<const Real>("points", points);
    return known == nullptr ? c.push(given, to()) : c.push(given, mask_of(*known), to());
  });
}

dynmesh_status dynmesh_push_sparse(dynmesh_completer* completer, const int32_t* indices,
                                   int64_t n_indices, const dynmesh_points* points,
                                   const dynmesh_output* out, dynmesh_frame_report* report) {
  return complete(completer, out, report, [&]<class Real>(Completer<Real>& c, auto to) {
    const std::size_t n = count_of("indices", n_indices);
    check_pointer("indices", indices, n);
    return c.push_sparse({indices, n}, points_of<const Real>("points", points), to());
  });
}

dynmesh_status dynmesh_tracker_push(dynmesh_tracker* tracker, const dynmesh_points* points,
                                    const dynmesh_points* normals, const dynmesh_points* viewpoints,
                                    const dynmesh_points* colours, const dynmesh_output* out,
                                    dynmesh_tracking_report* report) {
  return complete(tracker, out, report, [&]<class Real>(Tracker<Real>& t, auto to) {
    Scan<Real> scan = {points_of<const Real>("points", points)};
    if (normals != nullptr) scan.normals = points_of<const Real>("normals", normals);
    if (viewpoints != nullptr) scan.viewpoints = points_of<const Real>("viewpoints", viewpoints);
    if (colours != nullptr) scan.colours = points_of<const Real>("colours", colours);
    return t.push(scan, to());
  });
}

dynmesh_status dynmesh_tracker_push_depth(dynmesh_tracker* tracker,
                                          const dynmesh_depth_image* images, int64_t n_images,
                                          const dynmesh_output* out,
                                          dynmesh_tracking_report* report) {
  return complete(tracker, out, report, [&](auto& t, auto to) {
    return t.push_depth(images_of(images, n_images), to());
  });
}

int64_t dynmesh_n_vertices(const dynmesh_completer* completer) {
  int64_t k = 0;
  (void)at_any_time(completer, [&](const auto& c) { k = static_cast<int64_t>(c.n_vertices()); });
  return k;
}

dynmesh_status dynmesh_report(const dynmesh_completer* completer, dynmesh_frame_report* report) {
  return at_any_time(completer, [&](const auto& c) {
    check_pointer("report", report);
    store(c.report(), report);
  });
}

const uint8_t* dynmesh_tracker_observed(const dynmesh_tracker* tracker) {
  return data_of(tracker, [](const auto& t) { return t.observed(); });
}

dynmesh_status dynmesh_register(const dynmesh_registration_request* request,
                                const dynmesh_output* vertices, uint8_t* observed,
                                double* standard_error, dynmesh_registration_report* report) {
  return guarded([&] {
    check_pointer("request", request);
    check_pointer("vertices", vertices);
    with_training(
        "template", request->positions, request->training,
        [&]<class Real>(Points<const Real> positions, const Training<Real>* training) {
          const auto out = points_of<Real>("vertices", vertices, "the template");
          check_rows("vertices", out, positions.count);
          const auto found = registered(*request, positions, standard_error != nullptr, training);
          give(found.vertices, out, found.observed, observed, found.standard_error, standard_error);
          if (report != nullptr) {
            *report = to_c<dynmesh_registration_report>(found);
            report->measure = measure_of(found);
          }
        });
  });
}

dynmesh_status dynmesh_read_template(const char* path, const dynmesh_template** mesh) {
  return guarded([&] {
    check_pointer("mesh", mesh);
    *mesh = nullptr;
    check_pointer("path", path);
    *mesh = new OwnedTemplate(read_template(path));
  });
}

void dynmesh_free_template(const dynmesh_template* mesh) {
  // Each of them was made as one. NOLINTNEXTLINE(cppcoreguidelines-pro-type-static-cast-downcast)
  delete static_cast<const OwnedTemplate*>(mesh);
}
