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

/// Checks a matrix whose entries must be finite, and 0 or 1 where `expected` says so.
template <std::size_t n>
void check_entries(const char* argument, std::size_t number, const std::array<double, n>& matrix,
                   std::size_t columns, const std::array<char, n + 1>& expected, const char* form) {
  for (std::size_t e = 0; e < n; ++e) {
    const bool is_fixed = expected[e] != 'x';
    if (is_fixed ? matrix[e] == expected[e] - '0'
                 : std::abs(matrix[e]) <= largest_coordinate<double>) {
      continue;
    }
    refuse_image(argument, number,
                 "must be " + std::string(form) + " with finite numbers below 1e200, but row " +
                     std::to_string(e / columns) + ", column " + std::to_string(e % columns) +
                     " is " + in_words(matrix[e]));
  }
}

void check_intrinsics(std::size_t number, const std::array<double, 9>& k) {
  check_entries("intrinsics", number, k, 3, {"xxx0xx001"}, "[[fx, s, cx], [0, fy, cy], [0, 0, 1]]");
  if (k[0] > 0 && k[4] > 0) return;
  refuse_image("intrinsics", number,
               "are singular: the focal lengths are " + in_words(k[0]) + " and " + in_words(k[4]) +
                   " pixels, but must be positive");
}

Vector3<double> axis(const std::array<double, 16>& pose, std::size_t column) {
  return {pose[column], pose[4 + column], pose[8 + column]};
}

void check_pose(std::size_t number, const std::array<double, 16>& pose) {
  check_entries("pose", number, pose, 4, {"xxxxxxxxxxxx0001"}, "[[R, t], [0, 0, 0, 1]]");
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
