#include "arrays.hpp"

#include <cmath>
#include <cstdint>
#include <limits>
#include <utility>

namespace dynmesh {

py::array to_array(const char* argument, const py::object& object) {
  if (py::isinstance<py::array>(object)) {
    if (py::hasattr(object, "mask")) {
      throw py::type_error(std::string(argument) +
                           ": is a masked array, whose mask would be ignored; pass a plain "
                           "array, and the mask as `known`");
    }
    return py::reinterpret_borrow<py::array>(object);
  }
  try {
    return py::module_::import("numpy").attr("asarray")(object);
  } catch (const py::error_already_set& error) {
    if (!error.matches(PyExc_ValueError) && !error.matches(PyExc_TypeError)) throw;
    throw py::value_error(std::string(argument) + ": cannot be converted to an array: " +
                          std::string(py::str(error.value())));
  }
}

std::string dtype_name(const py::array& array) { return py::str(array.dtype()); }

bool is_to_be_spread(const py::array& array) {
  if (array.ndim() > 0 && array.shape(0) > std::numeric_limits<Index>::max()) return false;
  for (py::ssize_t axis = 0; axis < array.ndim(); ++axis) {
    if (array.shape(axis) > 1 && array.strides(axis) == 0) return true;
  }
  return false;
}

void check_shape(const char* argument, const py::array& array, py::ssize_t axes,
                 py::ssize_t columns, const char* expected) {
  if (array.ndim() == axes && (columns == 0 || array.shape(axes - 1) == columns)) return;
  throw py::value_error(std::string(argument) + ": must have shape " + expected + ", not " +
                        std::string(py::str(array.attr("shape"))));
}

py::array to_positions(const char* argument, const py::object& object) {
  const py::array array = to_array(argument, object);
  const auto size = array.itemsize();
  const char kind = array.dtype().kind();
  if (kind == 'f' && (size == 4 || size == 8)) return array;
  const bool is_list = py::isinstance<py::list>(object) || py::isinstance<py::tuple>(object);
  if (is_list && (kind == 'i' || kind == 'u')) return array.attr("astype")("float64");
  throw py::type_error(std::string(argument) + ": must be float32 or float64, not " +
                       dtype_name(array));
}

py::array_t<float> to_single(const py::array& array) {
  const auto wide = as_type<double>(array);
  const std::vector<py::ssize_t> shape(array.shape(), array.shape() + array.ndim());
  py::array_t<float> single(shape);
  const auto from = view_frame(wide, wide.data());
  const auto to = view_frame(single, single.mutable_data());
  constexpr float largest = std::numeric_limits<float>::max();
  for (std::size_t i = 0; i < from.count; ++i) {
    for (std::size_t c = 0; c < 3; ++c) {
      const double value = from(i, c);
      // NaN and infinities are preserved.
      const bool beyond = std::abs(value) > largest && std::isfinite(value);
      to(i, c) = beyond ? std::copysign(largest, static_cast<float>(std::copysign(1.0, value)))
                        : static_cast<float>(value);
    }
  }
  return single;
}

KnownArgument::KnownArgument(const py::object& object) : array_(to_array("known", object)) {
  const char kind = array_.dtype().kind();
  if (kind != 'b' && kind != 'i' && kind != 'u') {
    throw py::type_error("known: must be bool, or integers 0 and 1, not " + dtype_name(array_));
  }
  check_shape("known", array_, 1, 0, "(k,)");
  if (kind != 'b') {
    const py::array flags = array_.attr("astype")("bool");
    const py::object others = array_[array_.attr("__ne__")(flags)];
    if (py::len(others) > 0) {
      throw py::value_error("known: integers must be 0 or 1, not " +
                            std::string(py::str(others[py::int_(0)])));
    }
    array_ = flags;
  }
  if (is_to_be_spread(array_)) array_ = array_.attr("copy")();
}

KnownMask KnownArgument::view() const {
  return {static_cast<const std::uint8_t*>(array_.data()),
          static_cast<std::size_t>(array_.shape(0)), array_.strides(0)};
}

IndicesArgument::IndicesArgument(const char* argument, const py::object& object,
                                 py::ssize_t columns, const char* expected) {
  const py::array array = to_array(argument, object);
  const char kind = array.dtype().kind();
  // NumPy converts an empty list to float64.
  if (kind != 'i' && kind != 'u' && array.size() != 0) {
    throw py::type_error(std::string(argument) + ": must be integers, not " + dtype_name(array));
  }
  check_shape(argument, array, columns == 0 ? 1 : 2, columns, expected);

  using Packed = py::array_t<Index, py::array::c_style>;
  if (py::isinstance<Packed>(array) && viewable<Index>(array)) {
    array_ = py::reinterpret_borrow<py::array_t<Index>>(array);
    view_ = {array_.data(), static_cast<std::size_t>(array_.size())};
    return;
  }
  if (array.size() / 3 > std::numeric_limits<Index>::max()) {
    throw py::value_error(std::string(argument) + ": has shape " +
                          std::string(py::str(array.attr("shape"))) +
                          ", which is more than 32-bit indices can count");
  }
  if (kind == 'u' && array.itemsize() == sizeof(std::uint64_t)) {
    narrow<std::uint64_t>(argument, array, columns);
  } else {
    narrow<std::int64_t>(argument, array, columns);
  }
  view_ = narrowed_;
}

template <class Wide>
void IndicesArgument::narrow(const char* argument, const py::array& array, py::ssize_t columns) {
  const py::array_t<Wide, py::array::c_style | py::array::forcecast> wide(array);
  narrowed_.resize(static_cast<std::size_t>(wide.size()));
  for (std::size_t i = 0; i < narrowed_.size(); ++i) {
    const Wide value = wide.data()[i];
    if (!std::in_range<Index>(value)) {
      const std::size_t row = columns == 0 ? i : i / static_cast<std::size_t>(columns);
      throw py::value_error(std::string(argument) + ": row " + std::to_string(row) + " holds " +
                            std::to_string(value) + ", which cannot be a vertex index");
    }
    narrowed_[i] = static_cast<Index>(value);
  }
}

namespace {

py::object triangles_of(const py::object& faces, std::size_t n_vertices) {
  if (py::isinstance<py::array>(faces)) {
    const auto array = py::reinterpret_borrow<py::array>(faces);
    if (array.ndim() == 2 && array.shape(1) == 3) return faces;
  }
  const auto split = py::module_::import("dynmesh.polygons").attr("split_faces");
  return split(faces, n_vertices)[py::int_(0)];
}

}  // namespace

FacesArgument::FacesArgument(const py::object& faces, std::size_t n_vertices)
    : IndicesArgument("faces", triangles_of(faces, n_vertices), 3, "(m, 3)") {}

BytesArgument::BytesArgument(const char* argument, const py::object& object) {
  if (PyObject_CheckBuffer(object.ptr()) == 0) {
    throw py::type_error(std::string(argument) + ": must be bytes, not " + type_name(object));
  }
  buffer_ = py::reinterpret_borrow<py::buffer>(object).request();
  if (buffer_.itemsize != 1 || buffer_.ndim != 1 || buffer_.strides[0] != 1) {
    throw py::type_error(std::string(argument) + ": must be contiguous bytes");
  }
}

}  // namespace dynmesh
