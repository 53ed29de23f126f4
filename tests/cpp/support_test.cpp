/// Numbers, lent memory and rigid motions.
#include <doctest/doctest.h>

#include <array>
#include <charconv>
#include <cmath>
#include <limits>
#include <sstream>
#include <stdexcept>
#include <string>
#include <utility>
#include <vector>

#include "base/geometry.hpp"
#include "base/lender.hpp"
#include "base/rigid_motion.hpp"
#include "io/parse_number.hpp"

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
  std::array<float, 3> moved{};
  put_row(Points<float>(moved.data(), 1), 0, {1e300, -1e300, 3});
  CHECK(moved == std::array{largest_float, -largest_float, 3.0F});
}

TEST_CASE("a lender lends no more than it has, and the same memory again") {
  Lender<std::vector<int>> lender({1, 2, 3}, 2);
  const int* memory = nullptr;
  {
    Lent<std::vector<int>> one = lender.lend();
    const Lent<std::vector<int>> other = lender.lend();
    CHECK(one.data() != other.data());
    CHECK_THROWS_AS((void)lender.lend(), std::logic_error);
    const Lent<std::vector<int>> moved = std::move(one);
    memory = moved.data();
    CHECK_THROWS_AS((void)lender.lend(), std::logic_error);
  }
  const Lent<std::vector<int>> first = lender.lend(), second = lender.lend();
  CHECK((first.data() == memory || second.data() == memory));
}

TEST_CASE("points turn about a line unless they are nearer to it than rounding") {
  const std::vector<Index> chosen = {0, 1, 2, 3};
  for (const double width : {1e-1, 1e-3, 1e-4, 1e-6}) {
    const std::vector<Vector3> before = {{0, 0, -1}, {0, 0, 1}, {width, 0, 0}, {-width, 0, 0}};
    const std::vector<Vector3> after = {{0, 0, -1}, {0, 0, 1}, {0, width, 0}, {0, -width, 0}};
    const auto motion = fit_rigid_motion(chosen, before, after);
    const auto turned = motion.apply(Vector3{1, 0, 0});
    CHECK(turned.x == doctest::Approx(width > 1e-5 ? 0 : 1));
    CHECK(turned.y == doctest::Approx(width > 1e-5 ? 1 : 0));
  }
}

TEST_CASE("points whose squares are out of range move without a turn") {
  const std::vector<Index> chosen = {0, 1, 2, 3};
  const std::vector<Vector3> far = {{1e200, 0, 0}, {0, 1e200, 0}, {0, 0, 1e200}, {}};
  const auto motion = fit_rigid_motion(chosen, far, far);
  CHECK(motion.rotation == Eigen::Matrix3d::Identity());
  CHECK(motion.squared_across == 0);
}

#if !defined(_WIN32) && defined(__cpp_lib_to_chars)
TEST_CASE("numbers are read alike with and without std::from_chars") {
  std::istringstream texts(
      "0;-0;1;-1.5;.5;5.;1e3;1E-3;1e;1e+;-;--1;+1;; 1;1 2;1,5;0x10;1-2;1.2.3;1e400;-1e400;1e-400;"
      "4.9e-324;1e-310;2.2250738585072011e-308;0.1;9007199254740993;123456789012345678901234567890;"
      "3.4028234663852886e+38x");
  for (std::string text; std::getline(texts, text, ';');) {
    CAPTURE(text);
    double expected = 7;
    double value = 7;
    const char* end = text.data() + text.size();
    const auto one = std::from_chars(text.data(), end, expected);
    const auto other = parse_with_strtod(text.data(), end, value);
    CHECK(other.ec == one.ec);
    CHECK(other.ptr == one.ptr);
    CHECK(value == expected);
  }
}
#endif

}  // namespace
}  // namespace dynmesh::testing
