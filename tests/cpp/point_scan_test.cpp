/// What sensors measured: points with normals, also of depth images.
#include "surface_fit/point_scan.hpp"

#include <doctest/doctest.h>

#include <atomic>
#include <cmath>
#include <cstddef>
#include <random>
#include <thread>
#include <vector>

#include "base/geometry.hpp"
#include "base/workers.hpp"
#include "scans.hpp"
#include "surface_fit/scan_arguments.hpp"

namespace dynmesh::testing {
namespace {

TEST_CASE("a point of a scan counts for the viewpoint that its normal turns to") {
  PointScan scan;
  scan.points = {{0, 0, 1}, {0, 0, -1}, {0.1, 0, -1}};
  scan.normals = {{0, 0, 1}, {0.1, 0, -0.99}, {0, 0.1, 0.99}};
  scan.undecided = {0, 0, 1};
  scan.sensors = {{1, 0, 9}, {0, 1, -9}};
  Workers workers(1);
  scan.find_sensors(workers);
  CHECK(scan.sensor_of(0) == 0);
  CHECK(scan.sensor_of(1) == 1);
  CHECK(scan.sensor_of(2) == 0);
  scan.normals[2] = {0, 0.1, -0.99};
  scan.find_sensors(workers);
  CHECK(scan.sensor_of(2) == 1);
}

constexpr std::size_t image_height = 48;
constexpr std::size_t image_width = 64;

/// An image of a camera at the origin whose numbers all differ.
struct ObliqueImage {
  std::vector<float> pixels;

  /// It shows the plane z = distance + 0.2 x + 0.1 y.
  explicit ObliqueImage(double distance) {
    for (std::size_t row = 0; row < image_height; ++row) {
      for (std::size_t column = 0; column < image_width; ++column) {
        const double y = (static_cast<double>(row) - 22.7) / 60;
        const double x = (static_cast<double>(column) - 31.3 - 25 * y) / 70;
        pixels.push_back(static_cast<float>(distance / (1 - 0.2 * x - 0.1 * y)));
      }
    }
  }
  [[nodiscard]] DepthImage view() const {
    return {pixels.data(),
            image_height,
            image_width,
            image_width,
            1,
            {70, 25, 31.3, 0, 60, 22.7, 0, 0, 1},
            {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1}};
  }
};

const Vector3 towards_camera = (1 / std::sqrt(1.05)) * Vector3{0.2, 0.1, -1};

TEST_CASE("the points of a depth image lie on its surface, with its normal") {
  ObliqueImage near(5);
  const ObliqueImage far(50);
  near.pixels[20 * image_width + 30] = 0;
  const std::vector<DepthImage> images = {near.view(), far.view()};
  const auto check = [&](const PointScan& scan, double tolerance) {
    for (std::size_t i = 0; i < scan.size(); ++i) {
      const auto point = scan.points[i];
      const double distance = scan.sensor_of(i) == 0 ? 5 : 50;
      const double z = distance + 0.2 * point.x + 0.1 * point.y;
      CHECK(point.z == doctest::Approx(z).epsilon(tolerance));
      CHECK(dot(scan.normals[i], towards_camera) > 1 - tolerance);
    }
  };
  // Of the neighbours of the hole, each has others on its other sides.
  const PointScan scan = point_scan_of(images, 1, 2 * image_height * image_width);
  CHECK(scan.size() == 2 * image_height * image_width - 1);
  check(scan, 1e-6);
  const PointScan few = point_scan_of(images, 1, 2 * image_height * image_width / 9);
  CHECK(few.size() == 2 * (image_height / 3) * (image_width / 3));
  check(few, 1e-3);
}

/// The share of the normals that are more than 45 degrees off, as no match may be.
double share_of_wrong(const PointScan& scan, const Vector3& expected) {
  double wrong = 0;
  for (const auto& normal : scan.normals) wrong += std::abs(dot(normal, expected)) < 0.7;
  return wrong / static_cast<double>(scan.size());
}

TEST_CASE("noise as large as the distances between pixels leaves the normals of an image") {
  // Beside a hole, a jump and the borders as well.
  std::mt19937 random(7);
  for (const double noise : {0.05, 0.5, 1.0, 1.5}) {
    ObliqueImage image(5);
    std::normal_distribution<double> error(0, noise * 5 / 65);
    for (float& depth : image.pixels) depth += static_cast<float>(error(random));
    for (std::size_t row = 10; row < 20; ++row) {
      for (std::size_t column = 40; column < 50; ++column) {
        image.pixels[row * image_width + column] = column < 45 ? 0 : 9;
      }
    }
    const std::vector<DepthImage> images = {image.view()};
    const PointScan scan = point_scan_of(images, 1, image_height * image_width);
    CHECK(scan.size() > 2900);
    CHECK(share_of_wrong(scan, towards_camera) < 0.03);
  }
}

TEST_CASE("noise as large as the distances between points leaves the normals of a cloud") {
  std::mt19937 random(7);
  for (const double noise : {0.05, 0.5, 1.0}) {
    std::normal_distribution<double> error(0, noise);
    PointScan scan;
    scan.sensors = {{10, 10, 90}};
    for (int i = 0; i < 900; ++i) {
      scan.points.push_back(
          {i / 30 + error(random) / 9, i % 30 + error(random) / 9, error(random)});
    }
    Workers workers(1);
    scan.estimate_normals(1, workers);
    CHECK(share_of_wrong(scan, {0, 0, 1}) < 0.03);
  }
}

TEST_CASE("larger pixels are where those they replace are, without the stray ones") {
  ObliqueImage image(5);
  for (std::size_t i = 0; i < image.pixels.size(); i += 7) image.pixels[i] = 4;
  const std::vector<DepthImage> images = {image.view()};
  const PointScan scan = point_scan_of(images, 1, image_height * image_width / 9);
  CHECK(scan.size() == (image_height / 3) * (image_width / 3));
  for (const auto& point : scan.points) {
    CHECK(point.z == doctest::Approx(5 + 0.2 * point.x + 0.1 * point.y).epsilon(0.003));
  }
}

/// A grid on z = 0, of which the sensors estimate the normals.
PointScan& estimated(PointScan& scan) {
  Workers workers(1);
  for (int i = 0; i < 6; ++i) {
    for (int j = 0; j < 6; ++j) {
      scan.points.push_back({static_cast<double>(i), static_cast<double>(j), 0});
    }
  }
  scan.estimate_normals(1, workers);
  return scan;
}

TEST_CASE("normals point to where all sensors are, though some see the surface from the side") {
  for (const double side : {1.0, -1.0}) {
    PointScan scan;
    // 75 degrees and more from the normal.
    scan.sensors = {{2, 2, side * 9}, {40, 2, side * 9}};
    estimated(scan);
    for (std::size_t i = 0; i < scan.size(); ++i) {
      CHECK(scan.normals[i].z == doctest::Approx(side));
      CHECK_FALSE(scan.is_undecided(i));
    }
  }
}

TEST_CASE("between sensors that face each other, and without sensors, the side is undecided") {
  for (const bool any : {true, false}) {
    PointScan scan;
    // The second one sees the surface from the side.
    if (any) scan.sensors = {{2, 2, 9}, {40, 2, -9}};
    estimated(scan);
    for (std::size_t i = 0; i < scan.size(); ++i) {
      CHECK(std::abs(scan.normals[i].z) == doctest::Approx(1));
      CHECK(scan.is_undecided(i));
    }
  }
}

TEST_CASE("several threads search the points of a scan at once, also for the first time") {
  for (int n = 0; n < 50; ++n) {
    PointScan scan;
    estimated(scan);
    std::atomic<int> ready{0};
    std::atomic<int> right{0};
    std::vector<std::thread> threads;
    for (int i = 0; i < 4; ++i) {
      threads.emplace_back([&] {
        for (++ready; ready < 4;) std::this_thread::yield();
        if (scan.distance({2, 3, 0.5}) == 0.5) ++right;
      });
    }
    for (std::thread& thread : threads) thread.join();
    CHECK(right == 4);
  }
}

TEST_CASE("points that are repeated count once in normals") {
  // On a bent surface, in an order in which copies are not together.
  PointScan once;
  PointScan repeated;
  for (int i = 0; i < 8; ++i) {
    for (int j = 0; j < 8; ++j) {
      const double x = i + 0.1 * j;
      const double y = j - 0.07 * i;
      once.points.push_back({x, y, 0.02 * x * x - 0.03 * x * y});
    }
  }
  once.sensors = repeated.sensors = {{4, 4, 90}};
  for (int copy = 0; copy < 5; ++copy) {
    repeated.points.insert(repeated.points.end(), once.points.begin(), once.points.end());
  }
  Workers workers(1);
  for (PointScan* scan : {&once, &repeated}) scan->estimate_normals(1, workers);
  for (std::size_t i = 0; i < repeated.size(); ++i) {
    const auto expected = once.normals[i % once.size()];
    CHECK(dot(repeated.normals[i], expected) == doctest::Approx(1));
    CHECK_FALSE(repeated.is_undecided(i));
  }
}

}  // namespace
}  // namespace dynmesh::testing
