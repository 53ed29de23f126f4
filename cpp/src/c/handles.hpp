/// The objects behind the opaque handles of the C interface, and how its functions fail: exceptions
/// become a status and a message.
#pragma once

#include <dynmesh/dynmesh.h>

#include <dynmesh/completer.hpp>
#include <dynmesh/template_mesh.hpp>
#include <dynmesh/tracker.hpp>
#include <dynmesh/training.hpp>
#include <exception>
#include <new>
#include <stdexcept>
#include <system_error>
#include <variant>

#include "c/arguments.hpp"
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

/// Stores `message`, truncated to the available space after a whole character of UTF-8, as the last
/// message of this thread. Returns `status`.
dynmesh_status fail(dynmesh_status status, const char* message) noexcept;

/// A function of the caller asked for the work to be stopped.
struct Stopped : std::runtime_error {
  using std::runtime_error::runtime_error;
};

template <class Call>
dynmesh_status guarded(const Call& call) noexcept {
  try {
    call();
    return DYNMESH_OK;
  } catch (const std::invalid_argument& error) {
    return fail(DYNMESH_INVALID_ARGUMENT, error.what());
  } catch (const std::bad_alloc&) {
    return fail(DYNMESH_OUT_OF_MEMORY, "out of memory");
  } catch (const InUse& error) {
    return fail(DYNMESH_IN_USE, error.what());
  } catch (const Stopped& error) {
    return fail(DYNMESH_STOPPED, error.what());
  } catch (const UnreadableFile& error) {
    return fail(DYNMESH_UNREADABLE_FILE, error.what());
  } catch (const std::system_error& error) {  // a thread could not be started
    return fail(DYNMESH_OUT_OF_MEMORY, error.what());
  } catch (const std::exception& error) {
    return fail(DYNMESH_INTERNAL_ERROR, error.what());
  } catch (...) {
    return fail(DYNMESH_INTERNAL_ERROR, "an unknown exception");
  }
}

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
  return with_constant(handle, [&](auto& object) { handle->turns.enter([&] { call(object); }); });
}

/// Calls `call` with positions and a training sequence of their type, or with null for none.
template <class Call>
dynmesh_status with_training(const char* argument, const dynmesh_points* positions,
                             dynmesh_training* training, const Call& call) noexcept {
  if (training == nullptr) {
    return guarded([&] {
      with_type_of(argument, positions, [&]<class Real>(Points<const Real> given) {
        call(given, static_cast<const Training<Real>*>(nullptr));
      });
    });
  }
  return with(training, [&]<class Real>(const Training<Real>& frames) {
    call(points_of<const Real>(argument, positions, "the training sequence"), &frames);
  });
}

}  // namespace dynmesh
