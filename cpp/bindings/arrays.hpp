/// Views of NumPy arrays, which python/dynmesh/_arrays.py has converted, and values for Python.
#pragma once

#include <pybind11/numpy.h>
#include <pybind11/stl.h>

#include <cstddef>
#include <dynmesh/types.hpp>
#include <span>
#include <stdexcept>
#include <string>
#include <tuple>
#include <type_traits>
#include <vector>

#include "stream/report_fields.hpp"

namespace dynmesh {

namespace py = pybind11;

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
    if constexpr (requires { value.data(); }) {
      fields[name] = array_of(value);
    } else {
      fields[name] = value;
    }
  });
  return fields;
}

}  // namespace dynmesh
