/// How a function of the C interface fails: exceptions become a status and a message.
#pragma once

#include <dynmesh/dynmesh.h>

#include <dynmesh/template_mesh.hpp>
#include <exception>
#include <new>
#include <stdexcept>
#include <system_error>

#include "api/one_at_a_time.hpp"

namespace dynmesh {

/// Stores `message`, truncated to the available space after a whole character of UTF-8, as the last
/// message of this thread. Returns `status`.
dynmesh_status fail(dynmesh_status status, const char* message) noexcept;

/// Calls `call`, and fails if it throws.
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

}  // namespace dynmesh
