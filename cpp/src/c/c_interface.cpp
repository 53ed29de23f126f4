/// The C interface: converts arguments, calls Completer, and turns exceptions into a status.
#include <dynmesh/dynmesh.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <cstring>
#include <dynmesh/completer.hpp>
#include <dynmesh/settings.hpp>
#include <dynmesh/template_mesh.hpp>
#include <dynmesh/types.hpp>
#include <exception>
#include <limits>
#include <memory>
#include <new>
#include <span>
#include <stdexcept>
#include <string>
#include <system_error>
#include <type_traits>
#include <utility>
#include <variant>
#include <vector>

#include "completer/one_at_a_time.hpp"
#include "support/checks.hpp"

static_assert(std::is_same_v<dynmesh::Index, std::int32_t>);

struct dynmesh_completer {
  std::variant<dynmesh::Completer<float>, dynmesh::Completer<double>> any;
  mutable dynmesh::OneAtATime turns{};
};

namespace dynmesh {
namespace {

using Message = std::array<char, 1024>;  // of fixed size, since reporting that memory is exhausted
                                         // must not allocate any

Message& last_message() noexcept {
  thread_local Message message{};
  return message;
}

/// Stores `message`, truncated to the available space after a whole character of UTF-8.
dynmesh_status fail(dynmesh_status status, const char* message) noexcept {
  Message& kept = last_message();
  std::size_t size = std::strlen(message);
  if (size >= kept.size()) {
    const auto is_inside_character = [&](std::size_t i) { return (message[i] & 0xC0) == 0x80; };
    size = kept.size() - 1;
    for (int back = 0; back < 3 && is_inside_character(size); ++back) --size;
  }
  std::memmove(kept.data(), message, size);
  kept[size] = '\0';
  return status;
}

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

[[noreturn]] void refuse(const char* argument, const std::string& why) {
  throw std::invalid_argument(std::string(argument) + ": " + why);
}

void check_pointer(const char* argument, const void* pointer) {
  dynmesh::check_pointer(argument, pointer, 1);
}

/// Calls `call` with the Completer<float> or Completer<double> in `handle`. For properties that
/// never change.
template <class Handle, class Call>
dynmesh_status with_constant(Handle* handle, const Call& call) noexcept {
  return guarded([&] {
    check_pointer("completer", handle);
    std::visit(call, handle->any);
  });
}

/// The same for all other functions, which are refused while another thread is using the completer.
template <class Handle, class Call>
dynmesh_status with(Handle* handle, const Call& call) noexcept {
  return guarded([&] {
    check_pointer("completer", handle);
    handle->turns.enter([&] { std::visit(call, handle->any); });
  });
}

std::size_t count_of(const char* argument, std::int64_t count) {
  if (count < 0 || count > std::numeric_limits<Index>::max()) {
    refuse(argument, "cannot have " + std::to_string(count) + " rows");
  }
  return static_cast<std::size_t>(count);
}

/// Converts a view. `View` is dynmesh_points for `const Real` and dynmesh_output for `Real`.
template <class Real, class View>
Points<Real> points_of(const char* argument, const View* view) {
  constexpr std::int32_t type = sizeof(Real) == 4 ? DYNMESH_FLOAT32 : DYNMESH_FLOAT64;
  check_pointer(argument, view);
  if (view->type != type) {
    refuse(argument, "type must be " + std::to_string(type) + ", that of the first frame, not " +
                         std::to_string(view->type));
  }
  if (reinterpret_cast<std::uintptr_t>(view->data) % alignof(Real) != 0) {
    refuse(argument, "is not aligned to " + std::to_string(alignof(Real)) + " bytes");
  }
  // A stride of 0 means packed, as in OpenGL.
  const std::int64_t per_column = view->column_stride == 0 ? 1 : view->column_stride;
  if (view->row_stride == 0 && per_column != 1) {
    refuse(argument, "row_stride is 0, which means packed, but column_stride is " +
                         std::to_string(per_column) + ", not 1 or 0");
  }
  const std::int64_t per_row = view->row_stride == 0 ? 3 : view->row_stride;
  return {static_cast<Real*>(view->data), count_of(argument, view->count),
          static_cast<std::ptrdiff_t>(per_row), static_cast<std::ptrdiff_t>(per_column)};
}

KnownMask mask_of(const dynmesh_mask& mask) {
  const std::int64_t stride = mask.stride == 0 ? 1 : mask.stride;
  return {mask.data, count_of("known", mask.count), static_cast<std::ptrdiff_t>(stride)};
}

std::span<const Index> indices_of(const std::int32_t* indices, std::int64_t n_indices) {
  const std::size_t count = count_of("indices", n_indices);
  if (count > 0) check_pointer("indices", indices);
  return {indices, count};
}

Method method_of(std::int32_t method) {
  if (method == DYNMESH_METHOD_MOTION) return Method::motion;
  if (method == DYNMESH_METHOD_DETAIL) return Method::detail;
  refuse("method", "must be DYNMESH_METHOD_MOTION (0) or DYNMESH_METHOD_DETAIL (1), not " +
                       std::to_string(method));
}

UnseenRule unseen_rule_of(std::int32_t rule) {
  if (rule == DYNMESH_UNSEEN_HOLD) return UnseenRule::hold;
  if (rule == DYNMESH_UNSEEN_FOLLOW) return UnseenRule::follow;
  refuse("unseen", "must be DYNMESH_UNSEEN_HOLD (0) or DYNMESH_UNSEEN_FOLLOW (1), not " +
                       std::to_string(rule));
}

/// Later versions may support several sizes, with default values for the fields that smaller ones
/// lack.
void check_settings_size(const char* argument, std::int64_t size) {
  constexpr auto known = static_cast<std::int64_t>(sizeof(dynmesh_settings));
  if (size == known) return;
  refuse(argument, "is " + std::to_string(size) +
                       ", but this version of dynmesh expects settings of " +
                       std::to_string(known) + " bytes; call dynmesh_default_settings first");
}

Settings settings_of(const dynmesh_settings& given) {
  check_settings_size("settings.size", given.size);
  Settings settings;
  settings.method = method_of(given.method);
  settings.revisit = given.revisit != 0;
  settings.extra_iterations = given.extra_iterations;
  settings.unseen = unseen_rule_of(given.unseen);
  if (!std::isnan(given.noise)) settings.noise = given.noise;
  settings.reject_outliers = given.reject_outliers != 0;
  settings.threads = given.threads;
  return settings;
}

dynmesh_frame_report to_c(const FrameReport& report) {
  return {static_cast<std::int64_t>(report.known),      static_cast<std::int64_t>(report.filled),
          static_cast<std::int64_t>(report.unseen),     static_cast<std::int64_t>(report.rejected),
          static_cast<std::int64_t>(report.iterations), report.seconds};
}

void store(const FrameReport& report, dynmesh_frame_report* where) {
  if (where != nullptr) *where = to_c(report);
}

template <class Real>
dynmesh_completer* create(Faces faces, const dynmesh_points* first_frame,
                          const Settings& settings) {
  const auto frame = points_of<const Real>("first_frame", first_frame);
  return new dynmesh_completer{Completer<Real>(faces, frame, settings)};
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

}  // namespace
}  // namespace dynmesh

// C has no namespaces, so the functions of the interface are global. The functions they call are
// above.
using namespace dynmesh;

const char* dynmesh_last_message() { return last_message().data(); }

const char* dynmesh_version() { return DYNMESH_VERSION; }

dynmesh_status dynmesh_default_settings(dynmesh_settings* settings, int64_t size) {
  return guarded([&] {
    check_pointer("settings", settings);
    check_settings_size("size", size);
    const Settings defaults;
    *settings = {size,
                 DYNMESH_METHOD_MOTION,
                 defaults.revisit ? 1 : 0,
                 defaults.extra_iterations,
                 DYNMESH_UNSEEN_FOLLOW,
                 defaults.noise.value_or(std::numeric_limits<double>::quiet_NaN()),
                 defaults.reject_outliers ? 1 : 0,
                 defaults.threads};
  });
}

dynmesh_status dynmesh_create(const int32_t* faces, int64_t n_faces,
                              const dynmesh_points* first_frame, const dynmesh_settings* settings,
                              dynmesh_completer** completer) {
  return guarded([&] {
    check_pointer("completer", completer);
    *completer = nullptr;
    check_pointer("first_frame", first_frame);
    const Faces triangles{faces, count_of("faces", n_faces)};
    const auto chosen = settings == nullptr ? Settings{} : settings_of(*settings);
    switch (first_frame->type) {
      case DYNMESH_FLOAT32:
        *completer = create<float>(triangles, first_frame, chosen);
        break;
      case DYNMESH_FLOAT64:
        *completer = create<double>(triangles, first_frame, chosen);
        break;
      default:
        refuse("first_frame", "type must be DYNMESH_FLOAT32 (32) or DYNMESH_FLOAT64 (64), not " +
                                  std::to_string(first_frame->type));
    }
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
  return with(completer, [&]<class Real>(Completer<Real>& c) {
    store(c.skip(points_of<Real>("out", out)), report);
  });
}

dynmesh_status dynmesh_reset(dynmesh_completer* completer, const dynmesh_points* frame) {
  return with(completer, [&]<class Real>(Completer<Real>& c) {
    c.reset(points_of<const Real>("frame", frame));
  });
}

dynmesh_status dynmesh_state_size(const dynmesh_completer* completer, int64_t* size) {
  return with_constant(completer, [&](const auto& c) {
    check_pointer("size", size);
    *size = static_cast<int64_t>(c.state_size());
  });
}

dynmesh_status dynmesh_state(const dynmesh_completer* completer, void* state, int64_t size) {
  return with(completer, [&](const auto& c) {
    check_pointer("state", state);
    const std::size_t needed = c.state_size();
    if (size < static_cast<int64_t>(needed)) {
      refuse("state", "has room for " + std::to_string(size) + " bytes, but the state has " +
                          std::to_string(needed));
    }
    std::ranges::copy(c.state(), static_cast<std::byte*>(state));
  });
}

dynmesh_status dynmesh_restore(dynmesh_completer* completer, const void* state, int64_t size) {
  return with(completer, [&](auto& c) {
    check_pointer("state", state);
    if (size < 0) refuse("state", "cannot have " + std::to_string(size) + " bytes");
    c.restore({static_cast<const std::byte*>(state), static_cast<std::size_t>(size)});
  });
}

int64_t dynmesh_n_vertices(const dynmesh_completer* completer) {
  int64_t k = 0;
  (void)with_constant(completer, [&](const auto& c) { k = static_cast<int64_t>(c.n_vertices()); });
  return k;
}

const int32_t* dynmesh_generation(const dynmesh_completer* completer) {
  const int32_t* generation = nullptr;
  (void)with(completer, [&](const auto& c) { generation = c.generation().data(); });
  return generation;
}

const int32_t* dynmesh_age(const dynmesh_completer* completer) {
  const int32_t* age = nullptr;
  (void)with(completer, [&](const auto& c) { age = c.age().data(); });
  return age;
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
