#include "support/geometry.hpp"

#include <doctest/doctest.h>

#include <cmath>
#include <limits>
#include <vector>

#include "support/rigid_motion.hpp"

namespace dynmesh::testing {
namespace {

constexpr float largest_float = std::numeric_limits<float>::max();

// In constant expressions, the compiler refuses undefined conversions out of range.
static_assert(saturated<float>(1e300) == largest_float);
static_assert(saturated<float>(-1e300) == -largest_float);
static_assert(saturated<float>(1.5) == 1.5F);
static_assert(saturated<double>(-1e300) == -1e300);

TEST_CASE("numbers out of the range of float become the largest one") {
  CHECK(saturated<float>(std::numeric_limits<double>::infinity()) == largest_float);
  CHECK(std::isnan(saturated<float>(std::numeric_limits<double>::quiet_NaN())));
  RigidMotion motion;
  motion.to = {1e300, -1e300, 1};
  const auto moved = motion.apply(Vector3<float>{0, 0, 2});
  CHECK(moved.x == largest_float);
  CHECK(moved.y == -largest_float);
  CHECK(moved.z == 3);
}

TEST_CASE("points turn about a line unless they are nearer to it than rounding") {
  const std::vector<Index> chosen = {0, 1, 2, 3};
  for (const double width : {1e-1, 1e-3, 1e-4, 1e-6}) {
    const std::vector<Vector3<double>> before = {
        {0, 0, -1}, {0, 0, 1}, {width, 0, 0}, {-width, 0, 0}};
    const std::vector<Vector3<double>> after = {
        {0, 0, -1}, {0, 0, 1}, {0, width, 0}, {0, -width, 0}};
    const auto motion = fit_rigid_motion<double>(chosen, before, after);
    const auto turned = motion.apply(Vector3<double>{1, 0, 0});
    CHECK(turned.x == doctest::Approx(width > 1e-5 ? 0 : 1));
    CHECK(turned.y == doctest::Approx(width > 1e-5 ? 1 : 0));
  }
}

}  // namespace
}  // namespace dynmesh::testing
