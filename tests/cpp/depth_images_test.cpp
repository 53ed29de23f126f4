#include "tracking/depth_images.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>

#include "support/geometry.hpp"

namespace dynmesh::testing {
namespace {

constexpr std::size_t image_height = 48;
constexpr std::size_t image_width = 64;

/// A camera at the origin whose numbers all differ.
Camera oblique_camera() {
  return {70, 60, 31.3, 22.7, 25, {{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}}, {0, 0, 0}};
}

/// The depth, in a pixel, of the plane z = distance + 0.2 x + 0.1 y.
float depth_of_plane(const Camera& camera, std::size_t row, std::size_t column, double distance) {
  const auto ray = camera.at(row, column, 1);
  return static_cast<float>(distance / (1 - 0.2 * ray.x - 0.1 * ray.y));
}

std::span<float> add_plane(DepthImages& images, const Camera& camera, double distance) {
  const auto pixels = images.add(camera, image_height, image_width);
  for (std::size_t row = 0; row < image_height; ++row) {
    for (std::size_t column = 0; column < image_width; ++column) {
      pixels[row * image_width + column] = depth_of_plane(camera, row, column, distance);
    }
  }
  return pixels;
}

const Vector3<double> towards_camera = (1 / std::sqrt(1.05)) * Vector3<double>{0.2, 0.1, -1};

TEST_CASE("the points of a depth image lie on its surface, with its normal") {
  Workers workers(1);
  DepthImages images;
  const auto pixels = add_plane(images, oblique_camera(), 5);
  pixels[20 * image_width + 30] = 0;
  add_plane(images, oblique_camera(), 50);
  PointScan scan;
  // Of the neighbours of the hole, each has others on its other sides.
  images.convert(1, 2 * image_height * image_width, workers, scan);
  CHECK(scan.size() == 2 * image_height * image_width - 1);
  for (std::size_t i = 0; i < scan.size(); ++i) {
    const auto point = scan.point(i);
    const double distance = scan.sensor_of(i) == 0 ? 5 : 50;
    CHECK(point.z == doctest::Approx(distance + 0.2 * point.x + 0.1 * point.y).epsilon(1e-6));
    CHECK(dot(scan.normal(i), towards_camera) > 1 - 1e-6);
  }
  images.convert(1, 2 * image_height * image_width / 9, workers, scan);
  CHECK(scan.size() == 2 * (image_height / 3) * ((image_width + 2) / 3));
}

TEST_CASE("pixels beyond a jump are of other surfaces") {
  Workers workers(1);
  DepthImages images;
  const auto pixels = add_plane(images, oblique_camera(), 5);
  pixels[20 * image_width + 30] = 9;
  PointScan scan;
  images.convert(1, image_height * image_width, workers, scan);
  CHECK(scan.size() == image_height * image_width - 1);
}

}  // namespace
}  // namespace dynmesh::testing
