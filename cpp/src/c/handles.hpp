/// The objects behind the opaque handles of the C interface.
#pragma once

#include <dynmesh/dynmesh.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <dynmesh/completer.hpp>
#include <dynmesh/tracker.hpp>
#include <dynmesh/training.hpp>
#include <span>
#include <string>
#include <variant>

#include "c/arguments.hpp"
#include "c/status.hpp"
#include "stream/one_at_a_time.hpp"

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

/// Calls `call` with the object in `handle`, of float or of double. For properties that never
/// change.
template <class Handle, class Call>
dynmesh_status with_constant(Handle* handle, const Call& call) noexcept {
  return guarded([&] {
    check_pointer(Handle::name, handle);
    std::visit(call, handle->any);
  });
}

/// The same for all other functions, which are refused while another thread is using the object.
template <class Handle, class Call>
dynmesh_status with(Handle* handle, const Call& call) noexcept {
  return guarded([&] {
    check_pointer(Handle::name, handle);
    handle->turns.enter([&] { std::visit(call, handle->any); });
  });
}

/// Writes the state of `object` to a buffer of `size` bytes.
template <class Object>
void write_state(const Object& object, void* state, std::int64_t size) {
  check_pointer("state", state);
  const std::size_t needed = object.state_size();
  if (size < static_cast<std::int64_t>(needed)) {
    refuse("state", "has room for " + std::to_string(size) + " bytes, but the state has " +
                        std::to_string(needed));
  }
  std::ranges::copy(object.state(), static_cast<std::byte*>(state));
}

template <class Object>
void read_state(Object& object, const void* state, std::int64_t size) {
  check_pointer("state", state);
  if (size < 0) refuse("state", "cannot have " + std::to_string(size) + " bytes");
  object.restore({static_cast<const std::byte*>(state), static_cast<std::size_t>(size)});
}

/// Writes the standard errors of the last frame to an array of `count` numbers of `type`.
template <template <class> class Object, class Real>
void write_standard_error(const Object<Real>& object, void* values, std::int64_t count,
                          std::int32_t type) {
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
}

}  // namespace dynmesh
