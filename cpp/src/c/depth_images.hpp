/// Converts the depth images of the C interface to those of the C++ interface.
#pragma once

#include <dynmesh/dynmesh.h>

#include <algorithm>
#include <cstddef>
#include <dynmesh/tracker.hpp>
#include <string>
#include <vector>

#include "c/arguments.hpp"

namespace dynmesh {

inline std::size_t side_of(std::size_t number, const char* side, std::int64_t value) {
  if (value < 0) {
    refuse("images", "image " + std::to_string(number) + " cannot have a " + side + " of " +
                         std::to_string(value));
  }
  return static_cast<std::size_t>(value);
}

inline DepthImage image_of(std::size_t number, const dynmesh_depth_image& given) {
  DepthImage image;
  image.data = given.data;
  image.height = side_of(number, "height", given.height);
  image.width = side_of(number, "width", given.width);
  const bool is_packed = given.row_stride == 0;
  image.row_stride = static_cast<std::ptrdiff_t>(is_packed ? given.width : given.row_stride);
  image.column_stride =
      static_cast<std::ptrdiff_t>(is_packed || given.column_stride == 0 ? 1 : given.column_stride);
  std::ranges::copy(given.intrinsics, image.intrinsics.begin());
  std::ranges::copy(given.pose, image.pose.begin());
  return image;
}

inline std::vector<DepthImage> images_of(const dynmesh_depth_image* images, std::int64_t n_images) {
  const std::size_t count = count_of("images", n_images);
  if (count > 0) check_pointer("images", images);
  std::vector<DepthImage> converted(count);
  for (std::size_t i = 0; i < count; ++i) converted[i] = image_of(i, images[i]);
  return converted;
}

}  // namespace dynmesh
