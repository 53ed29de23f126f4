/// Converts the arguments of the C interface to those of the C++ interface, and reports to C.
#pragma once

#include <dynmesh/dynmesh.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <dynmesh/frame_report.hpp>
#include <dynmesh/quality.hpp>
#include <dynmesh/settings.hpp>
#include <dynmesh/tracker.hpp>
#include <dynmesh/types.hpp>
#include <string>
#include <type_traits>
#include <vector>

#include "api/report_fields.hpp"
#include "base/checks.hpp"

namespace dynmesh {

/// A number of rows, which must be one that an index can have.
std::size_t count_of(const char* argument, std::int64_t count);

template <class Real>
constexpr std::int32_t type_of = sizeof(Real) == 4 ? DYNMESH_FLOAT32 : DYNMESH_FLOAT64;

/// Converts a view, whose type must be that of `reference`. `View` is dynmesh_points for `const
/// Real` and dynmesh_output for `Real`.
template <class Real, class View>
Points<Real> points_of(const char* argument, const View* view,
                       const char* reference = "the first frame") {
  check_pointer(argument, view);
  if (view->type != type_of<Real>) {
    refuse(argument, "type must be ", type_of<Real>, ", that of ", reference, ", not ", view->type);
  }
  if (reinterpret_cast<std::uintptr_t>(view->data) % alignof(Real) != 0) {
    refuse(argument, "is not aligned to ", alignof(Real), " bytes");
  }
  // A stride of 0 means packed, as in OpenGL.
  const std::int64_t per_column = view->column_stride == 0 ? 1 : view->column_stride;
  if (view->row_stride == 0 && per_column != 1) {
    refuse(argument, "row_stride is 0, which means packed, but column_stride is ", per_column,
           ", not 1 or 0");
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
    refuse(argument, "must be DYNMESH_FLOAT32 (32) or DYNMESH_FLOAT64 (64), not ", type);
  }
}

Faces faces_of(const std::int32_t* faces, std::int64_t n_faces);
KnownMask mask_of(const dynmesh_mask& mask);
std::vector<DepthImage> images_of(const dynmesh_depth_image* images, std::int64_t n_images);

/// Later versions may support several sizes, with default values for the fields that smaller ones
/// lack.
void check_settings_size(const char* argument, std::int64_t size);
/// Null means the defaults.
Settings settings_of(const dynmesh_settings* chosen);

/// A report in C, without the structures in it.
template <class InC, class Report>
InC to_c(const Report& report) {
  InC converted = {};
  for_each_field<InC>(report, [&](const char*, const auto& value, auto... member) {
    [[maybe_unused]] const auto assign = [&](auto to) {
      if constexpr (requires { converted.*to; }) {
        auto& field = converted.*to;
        if constexpr (std::is_array_v<std::remove_reference_t<decltype(field)>>) {
          std::ranges::copy(value, field);
        } else {
          field = static_cast<std::remove_reference_t<decltype(field)>>(value);
        }
      }
    };
    (assign(member), ...);
  });
  return converted;
}

dynmesh_measure measure_of(const Measure& measure);

}  // namespace dynmesh
