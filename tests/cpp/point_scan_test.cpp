#include "tracking/point_scan.hpp"

#include <doctest/doctest.h>

#include <cmath>

#include "support/geometry.hpp"

namespace dynmesh::testing {
namespace {

/// A grid on z = 0, of which the sensors estimate the normals.
PointScan& estimated(PointScan& scan) {
  Workers workers(1);
  for (int i = 0; i < 6; ++i) {
    for (int j = 0; j < 6; ++j) {
      scan.points.push_back({static_cast<double>(i), static_cast<double>(j), 0});
    }
  }
  scan.index();
  scan.estimate_normals(workers);
  return scan;
}

TEST_CASE("normals point to where all sensors are, though some see the surface from the side") {
  for (const double side : {1.0, -1.0}) {
    PointScan scan;
    // 75 degrees and more from the normal.
    scan.sensors = {{2, 2, side * 9}, {40, 2, side * 9}};
    estimated(scan);
    for (std::size_t i = 0; i < scan.size(); ++i) {
      CHECK(scan.normal(i).z == doctest::Approx(side));
      CHECK_FALSE(scan.is_undecided(i));
    }
  }
}

TEST_CASE("between sensors that face each other, and without sensors, either side agrees") {
  for (const bool any : {true, false}) {
    PointScan scan;
    // The second one sees the surface from the side.
    if (any) scan.sensors = {{2, 2, 9}, {40, 2, -9}};
    estimated(scan);
    for (const double side : {1.0, -1.0}) {
      const auto found = scan.find({2.2, 2.1, 0.3}, {0, 0, side}, 1, 0.8);
      CHECK(found.any);
      CHECK(scan.point(found.index).x == 2);
      CHECK(scan.is_undecided(found.index));
    }
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
  for (PointScan* scan : {&once, &repeated}) {
    scan->index();
    scan->estimate_normals(workers);
  }
  for (std::size_t i = 0; i < repeated.size(); ++i) {
    const auto expected = once.normal(i % once.size());
    CHECK(dot(repeated.normal(i), expected) == doctest::Approx(1));
    CHECK_FALSE(repeated.is_undecided(i));
  }
}

}  // namespace
}  // namespace dynmesh::testing
