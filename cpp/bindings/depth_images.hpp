/// Converts depth images.
#pragma once

#include <algorithm>
#include <array>
#include <dynmesh/tracker.hpp>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "arrays.hpp"

namespace dynmesh {

/// The depth images of a frame, with the arrays that they view.
class ImagesArgument {
 public:
  ImagesArgument(const py::object& depth, const py::object& intrinsics, const py::object& pose) {
    const auto images = several("depth", depth, 2);
    const auto cameras = several("intrinsics", intrinsics, 2);
    const auto poses = several("pose", pose, 2);
    for (const auto& [name, count] :
         {std::pair{"intrinsics", cameras.size()}, std::pair{"pose", poses.size()}}) {
      if (count == images.size()) continue;
      throw py::value_error(std::string(name) + ": there are " + std::to_string(count) + ", but " +
                            std::to_string(images.size()) + " depth images");
    }
    for (std::size_t i = 0; i < images.size(); ++i) {
      const auto array = floating("depth", images[i]);
      check_shape("depth", array, 2, 0, "(h, w)");
      const auto& pixels = pixels_.emplace_back(Pixels(array));
      DepthImage image;
      image.data = pixels.data();
      image.height = static_cast<std::size_t>(pixels.shape(0));
      image.width = static_cast<std::size_t>(pixels.shape(1));
      image.row_stride = pixels.shape(1);
      fill("intrinsics", cameras[i], 3, image.intrinsics);
      fill("pose", poses[i], 4, image.pose);
      views_.push_back(image);
    }
  }
  [[nodiscard]] std::span<const DepthImage> view() const { return views_; }

 private:
  using Pixels = py::array_t<float, py::array::c_style | py::array::forcecast>;

  /// One array, or the list of its rows, is that of one camera; a list or a stack of such has one
  /// for each.
  static std::vector<py::object> several(const char* name, const py::object& given,
                                         py::ssize_t axes) {
    const bool is_array = py::isinstance<py::array>(given);
    if (is_array && py::reinterpret_borrow<py::array>(given).ndim() <= axes) return {given};
    if (!is_array && !py::isinstance<py::list>(given) && !py::isinstance<py::tuple>(given)) {
      throw py::type_error(std::string(name) + ": must be an array, or a list of arrays, not " +
                           type_name(given));
    }
    std::vector<py::object> found;
    for (const auto& item : given) found.push_back(py::reinterpret_borrow<py::object>(item));
    if (!found.empty() && to_array(name, found.front()).ndim() < axes) return {given};
    return found;
  }

  static py::array floating(const char* name, const py::object& object) {
    const auto array = to_array(name, object);
    if (array.dtype().kind() != 'f') {
      throw py::type_error(std::string(name) +
                           ": must be float32 or float64, in the unit of the "
                           "template, not " +
                           dtype_name(array) +
                           (array.dtype().kind() == 'u' || array.dtype().kind() == 'i'
                                ? "; multiply the counts of a sensor by the depth of one count"
                                : ""));
    }
    return array;
  }

  template <std::size_t size>
  static void fill(const char* name, const py::object& object, py::ssize_t rows,
                   std::array<double, size>& values) {
    const auto array = to_array(name, object);
    if (array.dtype().kind() != 'f' && array.dtype().kind() != 'i') {
      throw py::type_error(std::string(name) + ": must be numbers, not " + dtype_name(array));
    }
    const bool is_square = array.ndim() == 2 && array.shape(0) == rows && array.shape(1) == rows;
    if (!is_square) {
      const std::string side = std::to_string(rows);
      throw py::value_error(std::string(name) + ": must have shape (" + side + ", " + side +
                            "), not " + std::string(py::str(array.attr("shape"))));
    }
    const auto wide = py::array_t<double, py::array::c_style | py::array::forcecast>(array);
    std::copy_n(wide.data(), size, values.begin());
  }

  std::vector<Pixels> pixels_;
  std::vector<DepthImage> views_;
};

}  // namespace dynmesh
