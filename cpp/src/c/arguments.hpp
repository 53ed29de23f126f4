/// Converts the arguments of the C interface to those of the C++ interface.
#pragma once

#include <dynmesh/dynmesh.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <dynmesh/settings.hpp>
#include <dynmesh/types.hpp>
#include <limits>
#include <optional>
#include <span>
#include <stdexcept>
#include <string>
#include <type_traits>

#include "stream/settings_table.hpp"
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

/// Calls `call` with the positions of a view, which are float or double as its type says.
template <class Call>
void with_type_of(const char* argument, const dynmesh_points* view, const Call& call) {
  check_pointer(argument, view);
  if (view->type == DYNMESH_FLOAT32) {
    call(points_of<const float>(argument, view));
  } else if (view->type == DYNMESH_FLOAT64) {
    call(points_of<const double>(argument, view));
  } else {
    refuse(argument,
           std::string("type must be ") + known_types + ", not " + std::to_string(view->type));
  }
}

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

/// The value of a setting in C: an enumeration or a truth value as int32, and NaN for none.
template <class Value>
auto to_c(const Value& value) {
  if constexpr (std::is_same_v<Value, std::optional<double>>) {
    return value.value_or(std::numeric_limits<double>::quiet_NaN());
  } else {
    return static_cast<std::int32_t>(value);
  }
}

template <class Value, class Given>
Value setting_from_c(const char* name, Given given) {
  if constexpr (std::is_same_v<Value, std::optional<double>>) {
    return std::isnan(given) ? std::nullopt : Value(given);
  } else if constexpr (std::is_same_v<Value, bool>) {
    return given != 0;
  } else if constexpr (std::is_enum_v<Value>) {
    const auto& names = names_of<Value>;
    if (given >= 0 && static_cast<std::size_t>(given) < names.size()) {
      return static_cast<Value>(given);
    }
    std::string listed;
    for (std::size_t i = 0; i < names.size(); ++i) {
      std::string constant = std::string("DYNMESH_") + name + '_' + std::string(names[i]);
      std::ranges::transform(constant, constant.begin(),
                             [](unsigned char c) { return static_cast<char>(std::toupper(c)); });
      listed += (i == 0 ? "" : " or ") + constant + " (" + std::to_string(i) + ")";
    }
    refuse(name, "must be " + listed + ", not " + std::to_string(given));
  } else {
    return given;
  }
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
  for_each_setting(
      [&]<class Value>(const Setting& setting, Value Settings::*member, auto member_in_c) {
        settings.*member = setting_from_c<Value>(setting.name, given.*member_in_c);
      });
  return settings;
}

}  // namespace dynmesh
