#include "support/geometry.hpp"

#include <doctest/doctest.h>

#include <cmath>
#include <limits>

#include "support/rigid_motion.hpp"

namespace dynmesh::testing {
namespace {

constexpr float largest = std::numeric_limits<float>::max();

// In constant expressions, the compiler refuses undefined conversions out of range.
static_assert(saturated<float>(1e300) == largest);
static_assert(saturated<float>(-1e300) == -largest);
static_assert(saturated<float>(1.5) == 1.5F);
static_assert(saturated<double>(-1e300) == -1e300);

TEST_CASE("numbers out of the range of float become the largest one") {
  CHECK(saturated<float>(std::numeric_limits<double>::infinity()) == largest);
  CHECK(std::isnan(saturated<float>(std::numeric_limits<double>::quiet_NaN())));
  RigidMotion motion;
  motion.to = {1e300, -1e300, 1};
  const auto moved = motion.apply(Vector3<float>{0, 0, 2});
  CHECK(moved.x == largest);
  CHECK(moved.y == -largest);
  CHECK(moved.z == 3);
}

}  // namespace
}  // namespace dynmesh::testing
