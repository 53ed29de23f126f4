/// Views of NumPy arrays, scans and depth images, which python/dynmesh/_arrays.py has converted,
/// and values for Python; and what each file of this folder binds.
#pragma once

#include <pybind11/numpy.h>
#include <pybind11/stl.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <dynmesh/tracker.hpp>
#include <dynmesh/types.hpp>
#include <optional>
#include <stdexcept>
#include <string_view>
#include <tuple>
#include <type_traits>
#include <vector>

#include "api/report_fields.hpp"

namespace dynmesh {

namespace py = pybind11;
using Release = py::call_guard<py::gil_scoped_release>;

/// Returns what `call` returns, during which other threads may use Python.
template <class Call>
auto without_gil(const Call& call) {
  const py::gil_scoped_release release;
  return call();
}

void bind_functions(py::module_& module);
void bind_streams(py::module_& module);

/// An argument that is a packed array of this type. Unlike its base, it is never converted, so that
/// what is written to it arrives.
template <class T>
class Exact : public py::array_t<T, py::array::c_style> {
 public:
  using py::array_t<T, py::array::c_style>::array_t;
};

/// The number of frames, vertices or triangles in an array (..., 3).
template <class T>
std::size_t rows_in(const Exact<T>& array) {
  if (array.ndim() < 2 || array.shape(array.ndim() - 1) != 3) {
    throw std::invalid_argument("array: must have three columns");
  }
  return static_cast<std::size_t>(array.size()) / 3;
}

template <class Real>
Points<const Real> view(const Exact<Real>& array) {
  return {array.data(), rows_in(array)};
}

template <class Real>
Points<Real> writable(Exact<Real>& array) {
  return {array.mutable_data(), rows_in(array)};
}

inline Faces view(const Exact<Index>& faces) { return {faces.data(), rows_in(faces)}; }

inline KnownMask view(const Exact<bool>& known) {
  return {known.data(), static_cast<std::size_t>(known.size())};
}

/// (n,) a copy.
template <class Values>
auto array_of(const Values& values) {
  using T = std::remove_cvref_t<decltype(*values.data())>;
  return py::array_t<T>(static_cast<py::ssize_t>(values.size()), values.data());
}

/// The fields of a report by their names.
template <class Report>
py::dict fields_of(const Report& report) {
  py::dict fields;
  for_each_field(report, [&](const char* name, const auto& value, auto...) {
    if constexpr (std::is_same_v<std::remove_cvref_t<decltype(value)>, Quality>) {
      fields[name] = quality_names.at(static_cast<std::size_t>(value));
    } else if constexpr (requires { std::string_view(value.data()); }) {
      fields[name] = value.data();
    } else if constexpr (requires { value.data(); }) {
      fields[name] = array_of(value);
    } else {
      fields[name] = value;
    }
  });
  return fields;
}

template <class Real>
Scan<Real> scan_of(const Exact<Real>& points, const std::optional<Exact<Real>>& normals,
                   const std::optional<Exact<Real>>& viewpoints,
                   const std::optional<Exact<Real>>& colours) {
  Scan<Real> scan = {view(points)};
  if (normals) scan.normals = view(*normals);
  if (viewpoints) scan.viewpoints = view(*viewpoints);
  if (colours) scan.colours = view(*colours);
  return scan;
}

/// Of each camera: depths (h, w), intrinsics (3, 3), pose (4, 4) and colours (h, w, 3) or None.
using Images = std::vector<
    std::tuple<Exact<float>, Exact<double>, Exact<double>, std::optional<Exact<std::uint8_t>>>>;

inline std::vector<DepthImage> view(const Images& images) {
  std::vector<DepthImage> views;
  for (const auto& [depth, intrinsics, pose, colours] : images) {
    DepthImage& image = views.emplace_back();
    image.data = depth.data();
    image.height = static_cast<std::size_t>(depth.shape(0));
    image.width = static_cast<std::size_t>(depth.shape(1));
    image.row_stride = depth.shape(1);
    std::copy_n(intrinsics.data(), image.intrinsics.size(), image.intrinsics.begin());
    std::copy_n(pose.data(), image.pose.size(), image.pose.begin());
    if (colours) image.colours = colours->data();
  }
  return views;
}

}  // namespace dynmesh
