/// What the C functions of a completer and of a tracker have in common. `Handle` is
/// dynmesh_completer or dynmesh_tracker; the object in it has the member functions of Completer and
/// Tracker.
#pragma once

#include <dynmesh/dynmesh.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <dynmesh/frame_report.hpp>
#include <dynmesh/tracker.hpp>
#include <span>
#include <string>

#include "c/arguments.hpp"
#include "c/handles.hpp"
#include "c/status.hpp"

namespace dynmesh {

inline dynmesh_frame_report to_c(const FrameReport& report) {
  return {static_cast<std::int64_t>(report.known),
          static_cast<std::int64_t>(report.filled),
          static_cast<std::int64_t>(report.disconnected),
          static_cast<std::int64_t>(report.rejected),
          static_cast<std::int64_t>(report.iterations),
          report.seconds,
          report.stages.blend,
          report.stages.prior_weight,
          report.stages.prior_share,
          report.stages.first_order_share,
          report.standard_error};
}

inline dynmesh_agreement to_c(const Agreement& agreement) {
  return {static_cast<std::int64_t>(agreement.points), agreement.far_share, agreement.disagreeing,
          agreement.distance};
}

inline dynmesh_tracking_report to_c(const TrackingReport& report) {
  return {static_cast<std::int64_t>(report.known),
          static_cast<std::int64_t>(report.filled),
          static_cast<std::int64_t>(report.disconnected),
          static_cast<std::int64_t>(report.iterations),
          report.recovered ? 1 : 0,
          to_c(report.agreement),
          report.seconds};
}

/// Null means that the caller does not want the report.
template <class Report, class ReportInC>
void store(const Report& report, ReportInC* where) {
  if (where != nullptr) *where = to_c(report);
}

template <class Handle, class ReportInC>
dynmesh_status skip(Handle* handle, const dynmesh_output* out, ReportInC* report) {
  return with(handle, [&]<template <class> class Object, class Real>(Object<Real>& object) {
    store(object.skip(points_of<Real>("out", out)), report);
  });
}

template <class Handle>
dynmesh_status reset(Handle* handle, const dynmesh_points* frame) {
  return with(handle, [&]<template <class> class Object, class Real>(Object<Real>& object) {
    object.reset(points_of<const Real>("frame", frame));
  });
}

template <class Handle>
dynmesh_status state_size(const Handle* handle, std::int64_t* size) {
  return with_constant(handle, [&](const auto& object) {
    check_pointer("size", size);
    *size = static_cast<std::int64_t>(object.state_size());
  });
}

/// Writes the state to a buffer of `size` bytes.
template <class Handle>
dynmesh_status write_state(const Handle* handle, void* state, std::int64_t size) {
  return with(handle, [&](const auto& object) {
    check_pointer("state", state);
    const std::size_t needed = object.state_size();
    if (size < static_cast<std::int64_t>(needed)) {
      refuse("state", "has room for " + std::to_string(size) + " bytes, but the state has " +
                          std::to_string(needed));
    }
    std::ranges::copy(object.state(), static_cast<std::byte*>(state));
  });
}

template <class Handle>
dynmesh_status restore(Handle* handle, const void* state, std::int64_t size) {
  return with(handle, [&](auto& object) {
    check_pointer("state", state);
    if (size < 0) refuse("state", "cannot have " + std::to_string(size) + " bytes");
    object.restore({static_cast<const std::byte*>(state), static_cast<std::size_t>(size)});
  });
}

/// The data of an array of the last frame, which `get` returns; null without a valid handle.
template <class Handle, class Get>
auto data_of(const Handle* handle, const Get& get) {
  decltype(get(std::get<0>(handle->any)).data()) data = nullptr;
  (void)with(handle, [&](const auto& object) { data = get(object).data(); });
  return data;
}

template <class Handle>
const std::int32_t* generation(const Handle* handle) {
  return data_of(handle, [](const auto& object) { return object.generation(); });
}

template <class Handle>
const std::int32_t* age(const Handle* handle) {
  return data_of(handle, [](const auto& object) { return object.age(); });
}

/// Writes the standard errors of the last frame to an array of `count` numbers of `type`.
template <class Handle>
dynmesh_status standard_error(const Handle* handle, void* values, std::int64_t count,
                              std::int32_t type) {
  return with(handle, [&]<template <class> class Object, class Real>(const Object<Real>& object) {
    check_pointer("values", values);
    const std::span<const Real> found = object.standard_error();
    if (count != static_cast<std::int64_t>(found.size())) {
      refuse("count", "is " + std::to_string(count) + ", but the mesh has " +
                          std::to_string(found.size()) + " vertices");
    }
    const std::int32_t expected = sizeof(Real) == 4 ? DYNMESH_FLOAT32 : DYNMESH_FLOAT64;
    if (type != expected) {
      refuse("type", "must be " + std::to_string(expected) + ", that of the first frame, not " +
                         std::to_string(type));
    }
    std::ranges::copy(found, static_cast<Real*>(values));
  });
}

}  // namespace dynmesh
