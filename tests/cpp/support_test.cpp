/// Numbers, rigid motions and threads.
#include <doctest/doctest.h>

#include <atomic>
#include <charconv>
#include <cmath>
#include <limits>
#include <string_view>
#include <thread>
#include <vector>

#include "shared_work.hpp"
#include "support/geometry.hpp"
#include "support/parse_number.hpp"
#include "support/rigid_motion.hpp"
#include "support/workers.hpp"

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

#if !defined(_WIN32) && defined(__cpp_lib_to_chars)
TEST_CASE("numbers are read alike with and without std::from_chars") {
  for (const std::string_view text : {"0",
                                      "-0",
                                      "1",
                                      "-1.5",
                                      ".5",
                                      "5.",
                                      "1e3",
                                      "1E-3",
                                      "1e",
                                      "1e+",
                                      "-",
                                      "--1",
                                      "+1",
                                      "",
                                      " 1",
                                      "1 2",
                                      "1,5",
                                      "0x10",
                                      "1-2",
                                      "1.2.3",
                                      "1e400",
                                      "-1e400",
                                      "1e-400",
                                      "4.9e-324",
                                      "1e-310",
                                      "2.2250738585072011e-308",
                                      "0.1",
                                      "9007199254740993",
                                      "123456789012345678901234567890",
                                      "3.4028234663852886e+38x"}) {
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

TEST_CASE("every piece is executed once, and all before the call returns") {
  TaskSharing task_sharing;
  int calls = 3000;
  SUBCASE("if other threads are available") {}
  SUBCASE("by all threads") {
    task_sharing = in_small_pieces();
    calls = 160;
  }
  for (const Index threads : {1, 2, 5}) {
    Workers workers(threads, task_sharing);
    for (int call = 0; call < calls; ++call) {
      const Index count = call % 80;
      std::vector<std::atomic<int>> done(static_cast<std::size_t>(count));
      std::atomic<std::uint64_t> by_others{0};
      const auto caller = std::this_thread::get_id();
      const auto pieces = shared_pieces([&] {
        workers.for_each(count, [&](Index i) {
          ++done[static_cast<std::size_t>(i)];
          if (std::this_thread::get_id() != caller) ++by_others;
        });
      });
      for (const auto& times : done) REQUIRE(times == 1);
      REQUIRE(pieces == by_others);
      if (threads == 1 || count < task_sharing.fewest_pieces)
        REQUIRE(pieces == 0);
      else if (task_sharing.patience > 0)
        REQUIRE(pieces > 0);
    }
  }
}

TEST_CASE("threads end with their owner, whether or not they were used") {
  for (int i = 0; i < 50; ++i) {
    Workers workers(3, in_small_pieces());
    if (i % 2 == 0) workers.for_each(7, [](Index) {});
  }
}

}  // namespace
}  // namespace dynmesh::testing
