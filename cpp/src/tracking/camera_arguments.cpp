#include "tracking/camera_arguments.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <limits>
#include <stdexcept>
#include <string>

#include "support/checks.hpp"
#include "support/geometry.hpp"

namespace dynmesh {
namespace {

/// How far the rows of a rotation may be from orthonormal. Poses are often stored with six digits.
constexpr double rounding = 1e-3;

/// Larger images are a mistake.
constexpr std::size_t most_pixels = 1U << 28U;

[[noreturn]] void refuse_image(const char* argument, std::size_t number, const std::string& why) {
  throw std::invalid_argument(std::string(argument) + ": of image " + std::to_string(number) + " " +
                              why);
}

std::string in_words(double value) {
  std::array<char, 32> text{};
  (void)std::snprintf(text.data(), text.size(), "%.9g", value);
  return text.data();
}

void check_intrinsics(std::size_t number, const std::array<double, 9>& k) {
  for (std::size_t e = 0; e < k.size(); ++e) {
    if (std::isfinite(k[e])) continue;
    refuse_image("intrinsics", number,
                 "row " + std::to_string(e / 3) + ", column " + std::to_string(e % 3) + " is " +
                     in_words(k[e]) + ", but all must be finite");
  }
  if (!(k[0] > 0 && k[4] > 0)) {
    refuse_image("intrinsics", number,
                 "are singular: the focal lengths are " + in_words(k[0]) + " and " +
                     in_words(k[4]) + " pixels, but must be positive");
  }
  if (k[3] != 0 || k[6] != 0 || k[7] != 0 || k[8] != 1) {
    refuse_image("intrinsics", number,
                 "must be [[fx, s, cx], [0, fy, cy], [0, 0, 1]], but below the diagonal and in the "
                 "corner are " +
                     in_words(k[3]) + ", " + in_words(k[6]) + ", " + in_words(k[7]) + " and " +
                     in_words(k[8]));
  }
}

Vector3<double> axis(const std::array<double, 16>& pose, std::size_t column) {
  return {pose[column], pose[4 + column], pose[8 + column]};
}

void check_pose(std::size_t number, const std::array<double, 16>& pose) {
  for (std::size_t e = 0; e < pose.size(); ++e) {
    if (std::abs(pose[e]) <= largest_coordinate<double>) continue;
    refuse_image("pose", number,
                 "row " + std::to_string(e / 4) + ", column " + std::to_string(e % 4) + " is " +
                     in_words(pose[e]) + ", but all must be finite and below 1e200");
  }
  if (pose[12] != 0 || pose[13] != 0 || pose[14] != 0 || pose[15] != 1) {
    refuse_image("pose", number,
                 "must end in the row 0, 0, 0, 1, not " + in_words(pose[12]) + ", " +
                     in_words(pose[13]) + ", " + in_words(pose[14]) + ", " + in_words(pose[15]));
  }
  const auto x = axis(pose, 0);
  const auto y = axis(pose, 1);
  const auto z = axis(pose, 2);
  for (const double length : {squared_norm(x), squared_norm(y), squared_norm(z)}) {
    if (std::abs(length - 1) <= rounding) continue;
    refuse_image("pose", number,
                 "is not rigid: an axis has the squared length " + in_words(length) + ", not 1");
  }
  const double volume = dot(x, cross(y, z));
  if (std::abs(volume - 1) <= rounding) return;
  refuse_image("pose", number, "is not rigid: its determinant is " + in_words(volume) + ", not 1");
}

}  // namespace

void check_depth_image(std::size_t number, const DepthImage& image) {
  if (image.height == 0 || image.width == 0 || image.height > most_pixels / image.width) {
    refuse_image("depth", number,
                 "has " + std::to_string(image.height) + " rows and " +
                     std::to_string(image.width) + " columns, which is no image");
  }
  check_pointer("depth", image.data, image.height);
  if ((image.height > 1 && image.row_stride == 0) ||
      (image.width > 1 && image.column_stride == 0)) {
    refuse_image("depth", number, "has a stride of 0, with which its pixels would be the same");
  }
  check_intrinsics(number, image.intrinsics);
  check_pose(number, image.pose);
  for (std::size_t r = 0; r < image.height; ++r) {
    for (std::size_t c = 0; c < image.width; ++c) {
      const float depth = image.data[static_cast<std::ptrdiff_t>(r) * image.row_stride +
                                     static_cast<std::ptrdiff_t>(c) * image.column_stride];
      if (!(depth < 0)) continue;
      refuse_image("depth", number,
                   "row " + std::to_string(r) + ", column " + std::to_string(c) + " is " +
                       in_words(static_cast<double>(depth)) +
                       ", but depths are positive, or 0 or NaN where nothing was measured");
    }
  }
}

Camera camera_of(const DepthImage& image) {
  const auto& k = image.intrinsics;
  const auto& pose = image.pose;
  return {k[0],         k[4], k[2], k[5], k[1], {axis(pose, 0), axis(pose, 1), axis(pose, 2)},
          axis(pose, 3)};
}

void copy_depths(const DepthImage& image, std::span<float> depths) {
  for (std::size_t r = 0; r < image.height; ++r) {
    for (std::size_t c = 0; c < image.width; ++c) {
      const float depth = image.data[static_cast<std::ptrdiff_t>(r) * image.row_stride +
                                     static_cast<std::ptrdiff_t>(c) * image.column_stride];
      // Far beyond what any sensor measures, squares would not be finite.
      const bool is_measured = depth > 0 && depth < 1e18F;
      depths[r * image.width + c] = is_measured ? depth : 0;
    }
  }
}

}  // namespace dynmesh
