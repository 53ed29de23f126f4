#include "surface_fit/scan_arguments.hpp"

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <utility>
#include <vector>

#include "base/checks.hpp"
#include "base/geometry.hpp"
#include "base/statistics.hpp"

namespace dynmesh {
namespace {

/// How far the rows of a rotation may be from orthonormal. Poses are often stored with six digits.
constexpr double rounding = 1e-3;

/// Larger images are a mistake.
constexpr std::size_t most_pixels = 1U << 28U;

template <class... Parts>
[[noreturn]] void refuse_image(const char* argument, std::size_t number, const Parts&... why) {
  refuse(argument, "of image ", number, " ", why...);
}

/// Checks a matrix whose entries must be finite, and 0 or 1 where `expected` says so.
void check_entries(const char* argument, std::size_t number, std::span<const double> matrix,
                   std::size_t columns, const char* expected, const char* form) {
  for (std::size_t e = 0; e < matrix.size(); ++e) {
    const bool is_good = expected[e] == 'x' ? std::abs(matrix[e]) <= largest_coordinate<double>
                                            : matrix[e] == expected[e] - '0';
    if (is_good) continue;
    refuse_image(argument, number, "must be ", form, " with finite numbers below 1e200, but row ",
                 e / columns, ", column ", e % columns, " is ", to_text(matrix[e]));
  }
}

void check_intrinsics(std::size_t number, const std::array<double, 9>& k) {
  check_entries("intrinsics", number, k, 3, "xxx0xx001", "[[fx, s, cx], [0, fy, cy], [0, 0, 1]]");
  if (k[0] > 0 && k[4] > 0) return;
  refuse_image("intrinsics", number, "are singular: the focal lengths are ", to_text(k[0]), " and ",
               to_text(k[4]), " pixels, but must be positive");
}

/// Columns 0 to 2 of a pose are the directions right, down and ahead; column 3 is the position.
Vector3 axis(const std::array<double, 16>& pose, std::size_t column) {
  return {pose[column], pose[4 + column], pose[8 + column]};
}

void check_pose(std::size_t number, const std::array<double, 16>& pose) {
  check_entries("pose", number, pose, 4, "xxxxxxxxxxxx0001", "[[R, t], [0, 0, 0, 1]]");
  for (std::size_t c = 0; c < 3; ++c) {
    const double length = squared_norm(axis(pose, c));
    if (std::abs(length - 1) <= rounding) continue;
    refuse_image("pose", number, "is not rigid: an axis has the squared length ", to_text(length),
                 ", not 1");
  }
  const double volume = dot(axis(pose, 0), cross(axis(pose, 1), axis(pose, 2)));
  if (std::abs(volume - 1) <= rounding) return;
  refuse_image("pose", number, "is not rigid: its determinant is ", to_text(volume), ", not 1");
}

float depth_at(const DepthImage& image, std::size_t row, std::size_t column) {
  return image.data[static_cast<std::ptrdiff_t>(row) * image.row_stride +
                    static_cast<std::ptrdiff_t>(column) * image.column_stride];
}

void check_depth_image(std::size_t number, const DepthImage& image) {
  if (image.height == 0 || image.width == 0 || image.height > most_pixels / image.width) {
    refuse_image("depth", number, "has ", image.height, " rows and ", image.width,
                 " columns, which is no image");
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
      const float depth = depth_at(image, r, c);
      if (!(depth < 0)) continue;
      refuse_image("depth", number, "row ", r, ", column ", c, " is ",
                   to_text(static_cast<double>(depth)),
                   ", but depths are positive, or 0 or NaN where nothing was measured");
    }
  }
}

/// The depth of a pixel; 0 where nothing was measured. Far beyond what any sensor measures, squares
/// would not be finite.
float measured_depth(const DepthImage& image, std::size_t row, std::size_t column) {
  const float depth = depth_at(image, row, column);
  return depth > 0 && depth < 1e18F ? depth : 0;
}

struct Pixel {
  std::size_t row, column;

  bool operator==(const Pixel&) const = default;
};

/// An image of larger pixels, each the median of `size` by `size` ones, of which at least half must
/// have measured something. `depths` holds them.
DepthImage reduced(const DepthImage& image, std::size_t size, std::vector<float>& depths) {
  if (size == 1) return image;
  DepthImage small = image;
  small.height = image.height / size;
  small.width = image.width / size;
  depths.assign(small.height * small.width, 0.0F);
  small.data = depths.data();
  small.row_stride = static_cast<std::ptrdiff_t>(small.width);
  small.column_stride = 1;
  std::vector<double> measured;
  for (std::size_t p = 0; p < depths.size(); ++p) {
    const Pixel first = {p / small.width * size, p % small.width * size};
    measured.clear();
    for (std::size_t i = 0; i < size * size; ++i) {
      const float depth = measured_depth(image, first.row + i / size, first.column + i % size);
      if (depth > 0) measured.push_back(static_cast<double>(depth));
    }
    if (2 * measured.size() < size * size) continue;
    depths[p] = static_cast<float>(median(measured));
  }
  auto& k = small.intrinsics;
  const auto n = static_cast<double>(size);
  for (const std::size_t e : {0, 1, 4}) k[e] /= n;
  for (const std::size_t e : {2, 5}) k[e] = (k[e] - (n - 1) / 2) / n;
  return small;
}

/// The point that a pixel measured.
Vector3 point_of(const DepthImage& image, const Pixel& pixel) {
  const auto& k = image.intrinsics;
  const auto depth = static_cast<double>(measured_depth(image, pixel.row, pixel.column));
  const double y = (static_cast<double>(pixel.row) - k[5]) / k[4];
  const double x = (static_cast<double>(pixel.column) - k[2] - k[1] * y) / k[0];
  return axis(image.pose, 3) + depth * x * axis(image.pose, 0) + depth * y * axis(image.pose, 1) +
         depth * axis(image.pose, 2);
}

/// The mean colour of the pixels that measured something, of those that a pixel of a `size` times
/// smaller image stands for. There is one.
Vector3 colour_of(const DepthImage& image, std::size_t size, const Pixel& pixel) {
  Vector3 sum;
  double n = 0;
  for (std::size_t r = pixel.row * size; r < (pixel.row + 1) * size; ++r) {
    for (std::size_t c = pixel.column * size; c < (pixel.column + 1) * size; ++c) {
      if (!(measured_depth(image, r, c) > 0)) continue;
      const std::uint8_t* const colour = image.colours + 3 * (r * image.width + c);
      sum = sum + Vector3{static_cast<double>(colour[0]), static_cast<double>(colour[1]),
                          static_cast<double>(colour[2])};
      n += 1;
    }
  }
  return (1 / n) * sum;
}

/// The pixel beside one if it measured the same surface; otherwise that one itself.
Pixel beside(const DepthImage& image, const Pixel& pixel, const Pixel& other, double jump) {
  // The row and column before the first are unsigned numbers that have wrapped to beyond the last.
  if (other.row >= image.height || other.column >= image.width) return pixel;
  const float here = measured_depth(image, pixel.row, pixel.column);
  const float there = measured_depth(image, other.row, other.column);
  const bool is_near = there > 0 && std::abs(static_cast<double>(there - here)) <= jump;
  return is_near ? other : pixel;
}

/// The most pixels on each side of one from which its normal is found.
constexpr std::size_t widest = 4;

/// The standard deviation of the depths of an image, by the median of their second differences
/// along rows, in distances between the points of neighbouring pixels; 0 if there are none.
double relative_noise(const DepthImage& image, double jump) {
  std::vector<double> seconds;
  const std::size_t step = 1 + image.height * image.width / 10000;
  for (std::size_t p = 0; p < image.height * image.width; p += step) {
    const std::size_t row = p / image.width;
    const std::size_t column = p % image.width;
    if (column == 0 || column + 1 == image.width) continue;
    std::array<double, 3> z{};
    for (std::size_t i = 0; i < 3; ++i) {
      z[i] = static_cast<double>(measured_depth(image, row, column + i - 1));
    }
    const bool is_whole =
        std::ranges::min(z) > 0 && std::ranges::max(z) - std::ranges::min(z) <= jump;
    if (is_whole) seconds.push_back(std::abs(z[0] - 2 * z[1] + z[2]) * image.intrinsics[0] / z[1]);
  }
  // Of normal noise, the median is 0.6745 of the standard deviation, here of 1 - 2 + 1.
  return seconds.empty() ? 0 : median(seconds) / (0.6745 * std::sqrt(6.0));
}

/// How many pixels on each side of one determine its normal well enough; 0 if the next ones do.
std::size_t reach_of(double noise) {
  if (noise / std::sqrt(2.0) < most_uncertain_normal) return 0;
  std::size_t reach = 1;
  for (; reach < widest; ++reach) {
    const auto r = static_cast<double>(reach);
    // The variance of a slope: that of the noise over the sum of the squared offsets.
    if (noise / std::sqrt((2 * r + 1) * (2 * r + 1) * r * (r + 1) / 3) < most_uncertain_normal)
      break;
  }
  return reach;
}

/// The normal of the plane that fits the pixels around one best: the inverse of its depth is linear
/// in rows and columns. 0 if they are on a line.
Vector3 normal_around(const DepthImage& image, const Pixel& pixel, std::size_t reach, double jump) {
  const auto depth = static_cast<double>(measured_depth(image, pixel.row, pixel.column));
  Eigen::Matrix3d squares = Eigen::Matrix3d::Zero();
  Eigen::Vector3d products = Eigen::Vector3d::Zero();
  const auto from = [&](std::size_t at) { return at - std::min(at, reach); };
  for (std::size_t r = from(pixel.row); r <= pixel.row + reach && r < image.height; ++r) {
    for (std::size_t c = from(pixel.column); c <= pixel.column + reach && c < image.width; ++c) {
      const auto z = static_cast<double>(measured_depth(image, r, c));
      if (!(z > 0 && std::abs(z - depth) <= jump)) continue;
      const Eigen::Vector3d place(static_cast<double>(c) - static_cast<double>(pixel.column),
                                  static_cast<double>(r) - static_cast<double>(pixel.row), 1);
      squares += place * place.transpose();
      products += depth / z * place;
    }
  }
  const Eigen::FullPivLU<Eigen::Matrix3d> solver(squares);
  if (solver.rank() < 3) return {};
  const Eigen::Vector3d slope = solver.solve(products);
  const auto& k = image.intrinsics;
  const double u = static_cast<double>(pixel.column) - k[2];
  const double v = static_cast<double>(pixel.row) - k[5];
  // With K the intrinsics, X = z K^-1 (u, v, 1), so that the normal is K^T times the slopes.
  const double ahead = slope[2] - slope[0] * u - slope[1] * v;
  return unit_of(slope[0] * k[0] * axis(image.pose, 0) +
                 (slope[0] * k[1] + slope[1] * k[4]) * axis(image.pose, 1) +
                 ahead * axis(image.pose, 2));
}

}  // namespace

PointScan point_scan_of(std::span<const DepthImage> images, double jump, std::size_t most) {
  for (std::size_t i = 0; i < images.size(); ++i) {
    check_depth_image(i, images[i]);
    if ((images[i].colours == nullptr) == (images[0].colours == nullptr)) continue;
    refuse_image("colours", i, "are ", images[i].colours == nullptr ? "missing" : "given",
                 ", unlike those of image 0; all images have colours or none has");
  }
  double measured = 0;
  for (const DepthImage& image : images) {
    for (std::size_t r = 0; r < image.height; ++r) {
      for (std::size_t c = 0; c < image.width; ++c) measured += measured_depth(image, r, c) > 0;
    }
  }
  const auto size = static_cast<std::size_t>(
      std::max(1.0, std::floor(std::sqrt(measured / static_cast<double>(most)))));
  PointScan scan;
  std::vector<float> depths;
  for (const DepthImage& full : images) {
    const DepthImage image = reduced(full, size, depths);
    const std::size_t reach = reach_of(relative_noise(image, jump));
    const auto sensor = axis(image.pose, 3);
    const auto number = static_cast<std::uint32_t>(scan.sensors.size());
    scan.sensors.push_back(sensor);
    for (std::size_t row = 0; row < image.height; ++row) {
      for (std::size_t column = 0; column < image.width; ++column) {
        if (!(measured_depth(image, row, column) > 0)) continue;
        const Pixel here = {row, column};
        const Pixel left = beside(image, here, {row, column - 1}, jump);
        const Pixel right = beside(image, here, {row, column + 1}, jump);
        const Pixel above = beside(image, here, {row - 1, column}, jump);
        const Pixel below = beside(image, here, {row + 1, column}, jump);
        if (left == right || above == below) continue;
        const auto point = point_of(image, here);
        const auto normal = reach > 0 ? normal_around(image, here, reach, jump)
                                      : cross(point_of(image, below) - point_of(image, above),
                                              point_of(image, right) - point_of(image, left));
        const bool is_away = dot(normal, sensor - point) < 0;
        scan.points.push_back(point);
        scan.normals.push_back((is_away ? -1.0 : 1.0) * unit_of(normal));
        scan.sensor_numbers.push_back(number);
        if (full.colours != nullptr) scan.colours.push_back(colour_of(full, size, here));
      }
    }
  }
  return scan;
}

}  // namespace dynmesh
