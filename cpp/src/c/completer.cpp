/// The completer in the C interface: converts arguments, calls Completer, and turns exceptions into
/// a status.
#include <dynmesh/dynmesh.h>

#include <cstddef>
#include <cstdint>
#include <dynmesh/completer.hpp>
#include <dynmesh/settings.hpp>
#include <dynmesh/types.hpp>
#include <string>

#include "c/arguments.hpp"
#include "c/handles.hpp"
#include "c/status.hpp"
#include "c/stream.hpp"

using namespace dynmesh;  // C has no namespaces

const char* dynmesh_version() { return DYNMESH_VERSION; }

dynmesh_status dynmesh_default_settings(dynmesh_settings* settings, int64_t size) {
  return guarded([&] {
    check_pointer("settings", settings);
    check_settings_size("size", size);
    const Settings defaults;
    settings->size = size;
    for_each_setting([&](const Setting&, auto member, auto member_in_c) {
      settings->*member_in_c = to_c(defaults.*member);
    });
  });
}

dynmesh_status dynmesh_create(const int32_t* faces, int64_t n_faces,
                              const dynmesh_points* first_frame, const dynmesh_settings* settings,
                              dynmesh_completer** completer) {
  return guarded([&] {
    check_pointer("completer", completer);
    *completer = nullptr;
    with_type_of("first_frame", first_frame, [&]<class Real>(Points<const Real> frame) {
      *completer = new dynmesh_completer{
          Completer<Real>(faces_of(faces, n_faces), frame, settings_of(settings))};
    });
  });
}

void dynmesh_destroy(dynmesh_completer* completer) { delete completer; }

dynmesh_status dynmesh_push(dynmesh_completer* completer, const dynmesh_points* points,
                            const dynmesh_mask* known, const dynmesh_output* out,
                            dynmesh_frame_report* report) {
  return with(completer, [&]<class Real>(Completer<Real>& c) {
    const auto given = points_of<const Real>("points", points);
    const auto completed = points_of<Real>("out", out);
    store(known == nullptr ? c.push(given, completed) : c.push(given, mask_of(*known), completed),
          report);
  });
}

dynmesh_status dynmesh_push_sparse(dynmesh_completer* completer, const int32_t* indices,
                                   int64_t n_indices, const dynmesh_points* points,
                                   const dynmesh_output* out, dynmesh_frame_report* report) {
  return with(completer, [&]<class Real>(Completer<Real>& c) {
    const auto observed = indices_of(indices, n_indices);
    const auto given = points_of<const Real>("points", points);
    const auto completed = points_of<Real>("out", out);
    store(c.push_sparse(observed, given, completed), report);
  });
}

dynmesh_status dynmesh_skip(dynmesh_completer* completer, const dynmesh_output* out,
                            dynmesh_frame_report* report) {
  return skip(completer, out, report);
}

dynmesh_status dynmesh_reset(dynmesh_completer* completer, const dynmesh_points* frame) {
  return reset(completer, frame);
}

dynmesh_status dynmesh_state_size(const dynmesh_completer* completer, int64_t* size) {
  return state_size(completer, size);
}

dynmesh_status dynmesh_state(const dynmesh_completer* completer, void* state, int64_t size) {
  return write_state(completer, state, size);
}

dynmesh_status dynmesh_restore(dynmesh_completer* completer, const void* state, int64_t size) {
  return restore(completer, state, size);
}

int64_t dynmesh_n_vertices(const dynmesh_completer* completer) {
  int64_t k = 0;
  (void)with_constant(completer, [&](const auto& c) { k = static_cast<int64_t>(c.n_vertices()); });
  return k;
}

const int32_t* dynmesh_generation(const dynmesh_completer* completer) {
  return generation(completer);
}

const int32_t* dynmesh_age(const dynmesh_completer* completer) { return age(completer); }

dynmesh_status dynmesh_standard_error(const dynmesh_completer* completer, void* values,
                                      int64_t count, int32_t type) {
  return standard_error(completer, values, count, type);
}

dynmesh_status dynmesh_report(const dynmesh_completer* completer, dynmesh_frame_report* report) {
  return with(completer, [&](const auto& c) {
    check_pointer("report", report);
    *report = to_c(c.report());
  });
}

dynmesh_status dynmesh_topology(const dynmesh_completer* completer,
                                dynmesh_topology_report* report) {
  return with_constant(completer, [&](const auto& c) {
    check_pointer("report", report);
    const TopologyReport& found = c.topology();
    *report = {static_cast<int64_t>(found.components),
               static_cast<int64_t>(found.isolated_vertices),
               static_cast<int64_t>(found.boundary_edges),
               static_cast<int64_t>(found.refused_faces.size())};
  });
}

dynmesh_status dynmesh_refused_face(const dynmesh_completer* completer, int64_t number,
                                    int64_t* face, const char** reason) {
  return with_constant(completer, [&](const auto& c) {
    check_pointer("face", face);
    check_pointer("reason", reason);
    const auto& refused = c.topology().refused_faces;
    if (number < 0 || number >= static_cast<int64_t>(refused.size())) {
      refuse("number", "is " + std::to_string(number) + ", but " + std::to_string(refused.size()) +
                           " faces were refused, counted from 0");
    }
    const RefusedFace& found = refused[static_cast<std::size_t>(number)];
    *face = static_cast<int64_t>(found.index);
    *reason = found.reason.c_str();
  });
}
