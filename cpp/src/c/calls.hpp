/// What the functions of the C interface share: the objects behind its opaque handles, the
/// conversion of arguments to those of the C++ interface, and how a function fails: exceptions
/// become a status and a message.
#pragma once

#include <dynmesh/dynmesh.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <dynmesh/completer.hpp>
#include <dynmesh/template_mesh.hpp>
#include <dynmesh/tracker.hpp>
#include <dynmesh/training.hpp>
#include <limits>
#include <new>
#include <span>
#include <stdexcept>
#include <string>
#include <system_error>
#include <type_traits>
#include <variant>
#include <vector>

#include "stream/one_at_a_time.hpp"
#include "stream/report_fields.hpp"
#include "support/checks.hpp"

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

static_assert(std::is_same_v<Index, std::int32_t>);

[[noreturn]] inline void refuse(const std::string& argument, const std::string& why) {
  throw std::invalid_argument(argument + ": " + why);
}

inline std::size_t count_of(const char* argument, std::int64_t count) {
  if (count < 0 || count > std::numeric_limits<Index>::max()) {
    refuse(argument, "cannot have " + std::to_string(count) + " rows");
  }
  return static_cast<std::size_t>(count);
}

template <class Real>
constexpr std::int32_t type_of = sizeof(Real) == 4 ? DYNMESH_FLOAT32 : DYNMESH_FLOAT64;

/// Converts a view, whose type must be that of `reference`. `View` is dynmesh_points for `const
/// Real` and dynmesh_output for `Real`.
template <class Real, class View>
Points<Real> points_of(const char* argument, const View* view,
                       const char* reference = "the first frame") {
  check_pointer(argument, view);
  if (view->type != type_of<Real>) {
    refuse(argument, "type must be " + std::to_string(type_of<Real>) + ", that of " + reference +
                         ", not " + std::to_string(view->type));
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

/// Calls `call` with a zero of the type. `argument` is the name of what has it.
template <class Call>
void with_type(const std::string& argument, std::int32_t type, const Call& call) {
  if (type == DYNMESH_FLOAT32) {
    call(float{});
  } else if (type == DYNMESH_FLOAT64) {
    call(double{});
  } else {
    refuse(argument,
           "must be DYNMESH_FLOAT32 (32) or DYNMESH_FLOAT64 (64), not " + std::to_string(type));
  }
}

inline Faces faces_of(const std::int32_t* faces, std::int64_t n_faces) {
  return {faces, count_of("faces", n_faces)};
}

inline KnownMask mask_of(const dynmesh_mask& mask) {
  const std::int64_t stride = mask.stride == 0 ? 1 : mask.stride;
  return {mask.data, count_of("known", mask.count), static_cast<std::ptrdiff_t>(stride)};
}

/// A report in C.
template <class InC, class Report>
InC to_c(const Report& report) {
  InC converted = {};
  for_each_field(report, [&](const char*, const auto& value, auto... member) {
    [[maybe_unused]] const auto assign = [&](auto& field) {
      if constexpr (std::is_array_v<std::remove_reference_t<decltype(field)>>) {
        std::ranges::copy(value, field);
      } else {
        field = static_cast<std::remove_reference_t<decltype(field)>>(value);
      }
    };
    (assign(converted.*member), ...);
  });
  return converted;
}

inline std::vector<DepthImage> images_of(const dynmesh_depth_image* images, std::int64_t n_images) {
  const std::size_t count = count_of("images", n_images);
  check_pointer("images", images, count);
  std::vector<DepthImage> converted;
  for (const dynmesh_depth_image& given : std::span(images, count)) {
    const auto side = [&](const char* name, std::int64_t value) {
      if (value >= 0) return static_cast<std::size_t>(value);
      refuse("images", "image " + std::to_string(converted.size()) + " cannot have a " + name +
                           " of " + std::to_string(value));
    };
    const bool is_packed = given.row_stride == 0;
    const bool is_dense = is_packed || given.column_stride == 0;
    DepthImage image;
    image.data = given.data;
    image.height = side("height", given.height);
    image.width = side("width", given.width);
    image.row_stride = static_cast<std::ptrdiff_t>(is_packed ? given.width : given.row_stride);
    image.column_stride = static_cast<std::ptrdiff_t>(is_dense ? 1 : given.column_stride);
    std::ranges::copy(given.intrinsics, image.intrinsics.begin());
    std::ranges::copy(given.pose, image.pose.begin());
    converted.push_back(image);
  }
  return converted;
}

/// The last message of this thread. It is of fixed size, since reporting that memory is exhausted
/// must not allocate any.
inline std::array<char, 1024>& last_message() noexcept {
  thread_local std::array<char, 1024> message{};
  return message;
}

/// Stores `message`, truncated to the available space after a whole character of UTF-8, as the last
/// message of this thread. Returns `status`.
inline dynmesh_status fail(dynmesh_status status, const char* message) noexcept {
  auto& kept = last_message();
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

/// Calls `call` with the object in `handle`, of float or of double, which is refused while another
/// thread is using the object.
template <class Handle, class Call>
void enter(Handle* handle, const Call& call) {
  check_pointer(Handle::name, handle);
  handle->turns.enter([&] { std::visit(call, handle->any); });
}
template <class Handle, class Call>
dynmesh_status with(Handle* handle, const Call& call) noexcept {
  return guarded([&] { enter(handle, call); });
}

/// The same for properties that never change, which any thread may read.
template <class Handle, class Call>
dynmesh_status with_constant(Handle* handle, const Call& call) noexcept {
  return guarded([&] {
    check_pointer(Handle::name, handle);
    std::visit(call, handle->any);
  });
}

/// Calls `call` with positions, which are float or double as their type says, and a training
/// sequence of that type, or with null for none.
template <class Call>
void with_training(const char* argument, const dynmesh_points* positions,
                   dynmesh_training* training, const Call& call) {
  if (training != nullptr) {
    enter(training, [&]<class Real>(const Training<Real>& frames) {
      call(points_of<const Real>(argument, positions, "the training sequence"), &frames);
    });
    return;
  }
  check_pointer(argument, positions);
  with_type(std::string(argument) + ": type", positions->type, [&]<class Real>(Real) {
    call(points_of<const Real>(argument, positions), static_cast<const Training<Real>*>(nullptr));
  });
}

}  // namespace dynmesh
