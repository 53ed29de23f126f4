#include "tracking/depth_images.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>

#include "support/geometry.hpp"

namespace dynmesh::testing {
namespace {

constexpr std::size_t height = 48;
constexpr std::size_t width = 64;

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
  const auto pixels = images.add(camera, height, width);
  for (std::size_t row = 0; row < height; ++row) {
    for (std::size_t column = 0; column < width; ++column) {
      pixels[row * width + column] = depth_of_plane(camera, row, column, distance);
    }
  }
  return pixels;
}

/// The squared distance of the nearest of all points.
double least_squared_distance(const DepthImages& images, const Vector3<double>& position) {
  double least = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < images.size(); ++i) {
    least = std::min(least, squared_norm(images.point(i) - position));
  }
  return least;
}

const Vector3<double> towards_camera = (1 / std::sqrt(1.05)) * Vector3<double>{0.2, 0.1, -1};

TEST_CASE("the points of a depth image lie on its surface, with its normal") {
  Workers workers(1);
  DepthImages images;
  add_plane(images, oblique_camera(), 5);
  images.prepare(1, workers);
  CHECK(images.size() == height * width);
  for (std::size_t i = 0; i < images.size(); ++i) {
    const auto point = images.point(i);
    CHECK(point.z == doctest::Approx(5 + 0.2 * point.x + 0.1 * point.y).epsilon(1e-6));
    CHECK(dot(images.normal(i), towards_camera) > 1 - 1e-6);
  }
}

TEST_CASE("the nearest point of a full depth image is the nearest of all") {
  Workers workers(1);
  DepthImages images;
  const Camera camera = oblique_camera();
  add_plane(images, camera, 5);
  images.prepare(1, workers);
  std::mt19937 random(0);
  std::uniform_real_distribution<double> row(8, height - 8), column(8, width - 8), off(-0.4, 0.4);
  for (int n = 0; n < 200; ++n) {
    const auto r = static_cast<std::size_t>(row(random));
    const auto c = static_cast<std::size_t>(column(random));
    const auto depth = static_cast<double>(depth_of_plane(camera, r, c, 5));
    const auto position = camera.at(r, c, depth) + off(random) * towards_camera;
    const auto found = images.nearest(position, towards_camera, 2, 0.8, Measurement::no_guess);
    REQUIRE(found.weight == 1);
    CHECK(squared_norm(found.point - position) ==
          doctest::Approx(least_squared_distance(images, position)));
  }
}

TEST_CASE("the first pixel that is examined is the one where the vertex is drawn") {
  Workers workers(1);
  const Camera camera = oblique_camera();
  for (const std::size_t row : {3, 23, 44}) {
    for (const std::size_t column : {5, 30, 58}) {
      DepthImages images;
      const auto pixels = images.add(camera, height, width);
      for (const std::size_t i : {0, 1}) {  // nothing else was measured
        for (const std::size_t j : {0, 1}) {
          pixels[(row + i) * width + column + j] = depth_of_plane(camera, row + i, column + j, 5);
        }
      }
      images.prepare(1, workers);
      const auto depth = static_cast<double>(depth_of_plane(camera, row, column, 5));
      const auto position = camera.at(row, column, depth) + 0.01 * towards_camera;
      CHECK(images.nearest(position, towards_camera, 4, 0.8, Measurement::no_guess).weight == 1);
    }
  }
}

TEST_CASE("a vertex close to the camera finds points beyond a hole") {
  Workers workers(1);
  DepthImages images;
  const Camera camera = oblique_camera();
  const auto pixels = add_plane(images, camera, 1);
  const Vector3<double> position = {0, 0, 0.2};  // nearer than the radius of the search
  for (std::size_t row = 18; row < 28; ++row) {
    for (std::size_t column = 26; column < 37; ++column) pixels[row * width + column] = 0;
  }
  images.prepare(1, workers);
  const auto found = images.nearest(position, towards_camera, 2, 0.8, Measurement::no_guess);
  REQUIRE(found.weight == 1);
  CHECK(squared_norm(found.point - position) < 1.01 * least_squared_distance(images, position));
}

TEST_CASE(
    "the spacing of pixels is that of the points around, also at a corner and beside a hole") {
  const Camera camera = {10, 10, 4, 4, 0, {{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}}, {0, 0, 0}};
  DepthImages images;
  const auto pixels = images.add(camera, 9, 9);
  std::ranges::fill(pixels, 20.0F);  // two units apart
  pixels[3 * 9 + 5] = 0;             // diagonal to the middle
  Workers workers(1);
  images.prepare(1, workers);
  const auto spacing_at = [&](double x, double y, std::size_t neighbours) {
    for (std::size_t i = 0; i < images.size(); ++i) {
      const auto arm = images.point(i) - Vector3<double>{x, y, 20};
      if (squared_norm(arm) < 0.1) return images.squared_spacing(i, neighbours);
    }
    return -1.0;
  };
  CHECK(spacing_at(0, 0, 4) == doctest::Approx(4));
  CHECK(spacing_at(0, 0, 7) == doctest::Approx(8));
  CHECK(spacing_at(0, 0, 8) == doctest::Approx(16));  // without the hole 8
  CHECK(spacing_at(-8, -8, 4) == doctest::Approx(16));
  CHECK(spacing_at(-8, -8, 8) == doctest::Approx(32));
  CHECK(std::isinf(spacing_at(-8, -8, 9)));
}

TEST_CASE("space is free before what is measured, with a margin, and nowhere else") {
  Workers workers(1);
  DepthImages images;
  const Camera camera = oblique_camera();
  const auto pixels = add_plane(images, camera, 5);
  const std::size_t row = 20;
  const std::size_t column = 30;
  const auto at = [&](std::size_t r, std::size_t c) -> float& { return pixels[r * width + c]; };
  const auto before = [&](double depth) {
    return camera.at(row, column,
                     static_cast<double>(depth_of_plane(camera, row, column, 5)) - depth);
  };
  const auto is_free = [&](double depth) {
    return images.is_free(before(depth), towards_camera, 1);
  };
  CHECK(is_free(1.5));
  CHECK(images.is_free(before(1.5), -1.0 * towards_camera, 1));
  CHECK_FALSE(is_free(0.5));
  CHECK_FALSE(is_free(-1.5));
  const auto edge_on = cross(towards_camera, {0, 1, 0});
  CHECK_FALSE(images.is_free(before(1.5), edge_on, 1));
  CHECK_FALSE(images.is_free(camera.at(0, column, 3), towards_camera, 1));  // at the border
  CHECK_FALSE(images.is_free({0, 0, -3}, towards_camera, 1));               // behind the camera

  const float there = at(row + 1, column - 1);
  at(row + 1, column - 1) = there - 2;  // a silhouette
  CHECK_FALSE(is_free(1.5));
  at(row + 1, column - 1) = 0;  // not measured
  CHECK(is_free(1.5));
  const float middle = at(row, column);
  at(row, column) = 0;
  CHECK_FALSE(is_free(1.5));
  at(row, column) = middle;
  for (std::size_t c = column - 1; c <= column + 1; ++c) at(row - 1, c) = 0;
  CHECK(is_free(1.5));
  at(row, column + 1) = 0;
  CHECK_FALSE(is_free(1.5));
}

}  // namespace
}  // namespace dynmesh::testing
