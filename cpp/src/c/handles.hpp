/// The objects behind the opaque handles of the C interface.
#pragma once

#include <dynmesh/dynmesh.h>

#include <dynmesh/completer.hpp>
#include <dynmesh/tracker.hpp>
#include <dynmesh/training.hpp>
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

}  // namespace dynmesh
