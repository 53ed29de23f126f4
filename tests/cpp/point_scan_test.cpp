#include "tracking/point_scan.hpp"

#include <doctest/doctest.h>

#include <cmath>

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
      const auto found = scan.nearest({2.2, 2.1, 0.3}, {0, 0, side}, 1, 0.8, Measurement::no_guess);
      CHECK(found.weight == 1);
      CHECK(found.point.x == 2);
      CHECK(scan.is_undecided(found.number));
    }
  }
}

}  // namespace
}  // namespace dynmesh::testing
