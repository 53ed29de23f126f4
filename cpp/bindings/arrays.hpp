/// numpy arrays as the views of types.hpp. An array of the right kind is viewed where it lies,
/// strides and all; the view is valid as long as the argument object, so the GIL may be released
/// while it is in use.
#pragma once

#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>

#include <cstddef>
#include <dynmesh/types.hpp>
#include <span>
#include <string>
#include <type_traits>
#include <vector>

#include "scalars.hpp"

namespace dynmesh {

namespace py = pybind11;

/// numpy.asarray, whose errors get the argument's name. TypeError for a masked array, whose mask
/// would be lost.
py::array to_array(const char* argument, const py::object& object);

/// ValueError unless `array` has this many axes and, where `columns` > 0, that last axis.
void check_shape(const char* argument, const py::array& array, py::ssize_t axes,
                 py::ssize_t columns, const char* expected);

/// TypeError unless `array` holds float32 or float64.
void check_floating(const char* argument, const py::array& array);

std::string dtype_name(const py::array& array);

/// Whether the array must be copied to be viewed, as numpy has broadcast it: several of its
/// elements are one in memory, and the library refuses strides of 0. Not where it is longer than
/// any mesh, which is refused all the same, and for which there may be no memory.
bool is_to_be_spread(const py::array& array);

/// Whether element strides can express the array's, and its elements are aligned.
template <class T>
bool viewable(const py::array& array) {
  constexpr auto size = static_cast<py::ssize_t>(sizeof(T));
  bool in_elements = reinterpret_cast<std::uintptr_t>(array.data()) % alignof(T) == 0;
  for (py::ssize_t axis = 0; axis < array.ndim(); ++axis) {
    in_elements = in_elements && array.strides(axis) % size == 0;
  }
  return in_elements;
}

/// The array rounded to float32; what is finite but beyond its range becomes the largest number, so
/// that it is refused as too large, not taken as missing.
py::array_t<float> to_single(const py::array& array);

/// The array as `T`, itself where it is that already and no two of its elements are one.
template <class T>
py::array_t<T> as_type(const py::array& array) {
  if constexpr (std::is_same_v<T, float>) {
    if (array.itemsize() == sizeof(double)) return to_single(array);
  }
  py::array_t<T> typed = py::array_t<T, py::array::forcecast>(array);
  if (viewable<T>(typed) && !is_to_be_spread(typed)) return typed;
  return py::array_t<T, py::array::c_style | py::array::forcecast>(typed.attr("copy")());
}

/// Frame `frame` of a (k, 3) or (n, k, 3) array.
template <class T, class Array>
Points<T> view_frame(Array& array, T* data, py::ssize_t frame = 0) {
  constexpr auto size = static_cast<py::ssize_t>(sizeof(T));
  const py::ssize_t axis = array.ndim() - 2;
  const py::ssize_t offset = axis > 0 ? frame * array.strides(0) / size : 0;
  return {data + offset, static_cast<std::size_t>(array.shape(axis)), array.strides(axis) / size,
          array.strides(axis + 1) / size};
}

/// (n, 3) floating positions to read.
template <class Real>
class PointsArgument {
 public:
  PointsArgument(const char* argument, const py::object& object, const char* expected) {
    const py::array array = to_array(argument, object);
    check_floating(argument, array);
    check_shape(argument, array, 2, 3, expected);
    array_ = as_type<Real>(array);
  }
  [[nodiscard]] Points<const Real> view() const { return view_frame(array_, array_.data()); }

 private:
  py::array_t<Real> array_;
};

/// (k,) bool.
class KnownArgument {
 public:
  explicit KnownArgument(const py::object& object);
  [[nodiscard]] KnownMask view() const;

 private:
  py::array array_;
};

/// (n,) or (n, columns) integers.
class IndicesArgument {
 public:
  /// `columns` 0 asks for one axis.
  IndicesArgument(const char* argument, const py::object& object, py::ssize_t columns,
                  const char* expected);
  [[nodiscard]] std::span<const Index> view() const { return view_; }
  [[nodiscard]] Faces faces() const { return {view_.data(), view_.size() / 3}; }

 private:
  template <class Wide>
  void narrow(const char* argument, const py::array& array, py::ssize_t columns);

  py::array_t<Index> array_;
  std::vector<Index> narrowed_;
  std::span<const Index> view_;
};

/// (k, 3) positions to write: `out` as given, or a fresh array where it is None.
template <class Real>
class OutputArgument {
 public:
  OutputArgument(const py::object& out, std::size_t rows) {
    if (out.is_none()) {
      array_ = py::array_t<Real>({static_cast<py::ssize_t>(rows), py::ssize_t{3}});
      return;
    }
    if (!py::isinstance<py::array>(out)) {
      throw py::type_error("out: must be a numpy array, not " + type_name(out));
    }
    const auto array = to_array("out", out);
    if (!py::isinstance<py::array_t<Real>>(array)) {
      throw py::type_error("out: must be " + std::string(py::str(py::dtype::of<Real>())) +
                           ", as first_frame was, not " + dtype_name(array));
    }
    check_shape("out", array, 2, 3, "(k, 3)");
    if (!array.writeable()) throw py::value_error("out: is read-only");
    if (!viewable<Real>(array)) throw py::value_error("out: its elements are not aligned");
    array_ = py::reinterpret_borrow<py::array_t<Real>>(array);
  }
  [[nodiscard]] Points<Real> view() { return view_frame(array_, array_.mutable_data()); }
  [[nodiscard]] py::object array() const { return array_; }

 private:
  py::array_t<Real> array_;
};

}  // namespace dynmesh
