/// Converts the arguments of the C interface to those of the C++ interface.
#pragma once

#include <dynmesh/dynmesh.h>

#include <cmath>
#include <cstddef>
#include <cstdint>
#include <dynmesh/settings.hpp>
#include <dynmesh/types.hpp>
#include <limits>
#include <span>
#include <stdexcept>
#include <string>
#include <type_traits>

#include "support/checks.hpp"

namespace dynmesh {

static_assert(std::is_same_v<Index, std::int32_t>);

[[noreturn]] inline void refuse(const char* argument, const std::string& why) {
  throw std::invalid_argument(std::string(argument) + ": " + why);
}

inline void check_pointer(const char* argument, const void* pointer) {
  dynmesh::check_pointer(argument, pointer, 1);
}

inline std::size_t count_of(const char* argument, std::int64_t count) {
  if (count < 0 || count > std::numeric_limits<Index>::max()) {
    refuse(argument, "cannot have " + std::to_string(count) + " rows");
  }
  return static_cast<std::size_t>(count);
}

/// Converts a view, whose type must be that of `reference`. `View` is dynmesh_points for `const
/// Real` and dynmesh_output for `Real`.
template <class Real, class View>
Points<Real> points_of(const char* argument, const View* view,
                       const char* reference = "the first frame") {
  constexpr std::int32_t type = sizeof(Real) == 4 ? DYNMESH_FLOAT32 : DYNMESH_FLOAT64;
  check_pointer(argument, view);
  if (view->type != type) {
    refuse(argument, "type must be " + std::to_string(type) + ", that of " + reference + ", not " +
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

constexpr const char* known_types = "DYNMESH_FLOAT32 (32) or DYNMESH_FLOAT64 (64)";

inline Faces faces_of(const std::int32_t* faces, std::int64_t n_faces) {
  return {faces, count_of("faces", n_faces)};
}

inline KnownMask mask_of(const dynmesh_mask& mask) {
  const std::int64_t stride = mask.stride == 0 ? 1 : mask.stride;
  return {mask.data, count_of("known", mask.count), static_cast<std::ptrdiff_t>(stride)};
}

inline std::span<const Index> indices_of(const std::int32_t* indices, std::int64_t n_indices) {
  const std::size_t count = count_of("indices", n_indices);
  if (count > 0) check_pointer("indices", indices);
  return {indices, count};
}

inline Method method_of(std::int32_t method) {
  if (method == DYNMESH_METHOD_MOTION) return Method::motion;
  if (method == DYNMESH_METHOD_DETAIL) return Method::detail;
  refuse("method", "must be DYNMESH_METHOD_MOTION (0) or DYNMESH_METHOD_DETAIL (1), not " +
                       std::to_string(method));
}

inline DisconnectedRule disconnected_rule_of(std::int32_t rule) {
  if (rule == DYNMESH_DISCONNECTED_HOLD) return DisconnectedRule::hold;
  if (rule == DYNMESH_DISCONNECTED_FOLLOW) return DisconnectedRule::follow;
  refuse("disconnected",
         "must be DYNMESH_DISCONNECTED_HOLD (0) or DYNMESH_DISCONNECTED_FOLLOW (1), not " +
             std::to_string(rule));
}

/// Later versions may support several sizes, with default values for the fields that smaller ones
/// lack.
inline void check_settings_size(const char* argument, std::int64_t size) {
  constexpr auto known = static_cast<std::int64_t>(sizeof(dynmesh_settings));
  if (size == known) return;
  refuse(argument, "is " + std::to_string(size) +
                       ", but this version of dynmesh expects settings of " +
                       std::to_string(known) + " bytes; call dynmesh_default_settings first");
}

/// Null means the defaults.
inline Settings settings_of(const dynmesh_settings* chosen) {
  Settings settings;
  if (chosen == nullptr) return settings;
  const dynmesh_settings& given = *chosen;
  check_settings_size("settings.size", given.size);
  settings.method = method_of(given.method);
  settings.revisit = given.revisit != 0;
  settings.extra_iterations = given.extra_iterations;
  settings.disconnected = disconnected_rule_of(given.disconnected);
  if (!std::isnan(given.noise)) settings.noise = given.noise;
  settings.reject_outliers = given.reject_outliers != 0;
  settings.learn = given.learn != 0;
  settings.uncertainty = given.uncertainty != 0;
  settings.threads = given.threads;
  return settings;
}

}  // namespace dynmesh
