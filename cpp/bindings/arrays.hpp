/// Converts NumPy arrays to the views of types.hpp. An array of a suitable type is viewed without
/// copying, with its strides. A view is valid during the lifetime of the argument object, so the
/// GIL may be released while it is in use.
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

/// Calls numpy.asarray and adds the name of the argument to its errors. Raises TypeError for a
/// masked array, whose mask would be ignored.
py::array to_array(const char* argument, const py::object& object);

/// Raises ValueError unless `array` has this number of axes and, if `columns` > 0, this number of
/// columns in the last one.
void check_shape(const char* argument, const py::array& array, py::ssize_t axes,
                 py::ssize_t columns, const char* expected);

/// Converts positions, of any shape. Raises TypeError unless the dtype is float32 or float64; a
/// list of whole numbers becomes float64.
py::array to_positions(const char* argument, const py::object& object);

std::string dtype_name(const py::array& array);

/// Whether the array must be copied before it can be viewed, because NumPy has broadcast it:
/// several of its elements share memory, and the library refuses strides of 0. An array that is
/// longer than any mesh is not copied; it is refused later, and memory might not suffice for a
/// copy.
bool is_to_be_spread(const py::array& array);

/// Whether the strides of the array are multiples of the element size and its elements are aligned.
template <class T>
bool viewable(const py::array& array) {
  constexpr auto size = static_cast<py::ssize_t>(sizeof(T));
  bool in_elements = reinterpret_cast<std::uintptr_t>(array.data()) % alignof(T) == 0;
  for (py::ssize_t axis = 0; axis < array.ndim(); ++axis) {
    in_elements = in_elements && array.strides(axis) % size == 0;
  }
  return in_elements;
}

/// Rounds the array to float32. A finite number out of range becomes the largest float32, so that
/// it is refused as too large and does not count as missing.
py::array_t<float> to_single(const py::array& array);

/// Converts the array to `T`. Returns the array itself if it can be viewed as it is.
template <class T>
py::array_t<T> as_type(const py::array& array) {
  if constexpr (std::is_same_v<T, float>) {
    if (array.itemsize() == sizeof(double)) return to_single(array);
  }
  py::array_t<T> typed = py::array_t<T, py::array::forcecast>(array);
  if (viewable<T>(typed) && !is_to_be_spread(typed)) return typed;
  return py::array_t<T, py::array::c_style | py::array::forcecast>(typed.attr("copy")());
}

/// Returns a view of frame `frame` of a (k, 3) or (n, k, 3) array.
template <class T, class Array>
Points<T> view_frame(Array& array, T* data, py::ssize_t frame = 0) {
  constexpr auto size = static_cast<py::ssize_t>(sizeof(T));
  const py::ssize_t axis = array.ndim() - 2;
  const py::ssize_t offset = axis > 0 ? frame * array.strides(0) / size : 0;
  return {data + offset, static_cast<std::size_t>(array.shape(axis)), array.strides(axis) / size,
          array.strides(axis + 1) / size};
}

/// An (n, 3) floating-point array of positions to read.
template <class Real>
class PointsArgument {
 public:
  PointsArgument(const char* argument, const py::object& object, const char* expected) {
    const py::array array = to_positions(argument, object);
    check_shape(argument, array, 2, 3, expected);
    array_ = as_type<Real>(array);
  }
  [[nodiscard]] Points<const Real> view() const { return view_frame(array_, array_.data()); }

 private:
  py::array_t<Real> array_;
};

/// (n,) a copy.
template <class T>
py::array_t<T> array_of(const std::vector<T>& values) {
  return py::array_t<T>(static_cast<py::ssize_t>(values.size()), values.data());
}

/// A (k,) array of bool, or of integers that are 0 or 1.
class KnownArgument {
 public:
  explicit KnownArgument(const py::object& object);
  [[nodiscard]] KnownMask view() const;

 private:
  py::array array_;
};

/// An (n,) or (n, columns) array of integers.
class IndicesArgument {
 public:
  /// If `columns` is 0, the array must have one axis.
  IndicesArgument(const char* argument, const py::object& object, py::ssize_t columns,
                  const char* expected);
  [[nodiscard]] std::span<const Index> view() const { return view_; }

 private:
  template <class Wide>
  void narrow(const char* argument, const py::array& array, py::ssize_t columns);

  py::array_t<Index> array_;
  std::vector<Index> narrowed_;
  std::span<const Index> view_;
};

/// The faces of a mesh: (m, 3) integers or, as dynmesh.polygons.split_faces takes them, polygons,
/// which are cut into triangles.
class FacesArgument : public IndicesArgument {
 public:
  FacesArgument(const py::object& faces, std::size_t n_vertices);
  [[nodiscard]] Faces view() const {
    return {IndicesArgument::view().data(), IndicesArgument::view().size() / 3};
  }
};

/// Bytes, or another object with a contiguous buffer of bytes.
class BytesArgument {
 public:
  BytesArgument(const char* argument, const py::object& object);
  [[nodiscard]] std::span<const std::byte> view() const {
    return {static_cast<const std::byte*>(buffer_.ptr), static_cast<std::size_t>(buffer_.size)};
  }

 private:
  py::buffer_info buffer_;
};

/// A (k, 3) array of positions to write: `out`, or a new array if it is None.
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
                           ", the dtype of first_frame, not " + dtype_name(array));
    }
    check_shape("out", array, 2, 3, "(k, 3)");
    if (!array.writeable()) throw py::value_error("out: is read-only");
    if (!viewable<Real>(array)) throw py::value_error("out: is not aligned");
    array_ = py::reinterpret_borrow<py::array_t<Real>>(array);
  }
  [[nodiscard]] Points<Real> view() { return view_frame(array_, array_.mutable_data()); }
  [[nodiscard]] py::object array() const { return array_; }

 private:
  py::array_t<Real> array_;
};

}  // namespace dynmesh
