/// Numbers, rigid motions and threads.
#include <doctest/doctest.h>

#include <array>
#include <atomic>
#include <charconv>
#include <chrono>
#include <cmath>
#include <dynmesh/completer.hpp>
#include <limits>
#include <sstream>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include "api/one_at_a_time.hpp"
#include "base/geometry.hpp"
#include "base/rigid_motion.hpp"
#include "base/workers.hpp"
#include "c_completer.hpp"
#include "io/parse_number.hpp"
#include "meshes.hpp"
#include "shared_work.hpp"

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

TEST_CASE("an exception of a piece reaches the caller when no thread is at work any more") {
  Workers workers(3, in_small_pieces());
  const auto caller = std::this_thread::get_id();
  for (const bool is_of_caller : {true, false}) {
    for (int call = 0; call < 20; ++call) {
      std::atomic<int> at_work{0};
      auto failing = [&](Index) {
        ++at_work;
        std::this_thread::sleep_for(std::chrono::milliseconds(2));  // less is nothing on Windows
        const bool fails = (std::this_thread::get_id() == caller) == is_of_caller;
        --at_work;
        if (fails) throw std::runtime_error("of a piece");
      };
      CHECK(message_of([&] { workers.for_each(40, failing); }) == "of a piece");
      CHECK(at_work == 0);
      std::atomic<int> done{0};
      workers.for_each(40, [&](Index) { ++done; });
      CHECK(done == 40);
    }
  }
}

template <class Work>
void in_threads(int count, const Work& work) {
  std::vector<std::thread> threads;
  threads.reserve(static_cast<std::size_t>(count));
  for (int i = 0; i < count; ++i) threads.emplace_back([&work, i] { work(i); });
  for (auto& thread : threads) thread.join();
}

TEST_CASE("one call is executed at a time, and another one after it, even if it failed") {
  OneAtATime turns;
  CHECK(turns.enter([&] {
    const auto refused = message_of([&] { turns.enter([] { FAIL("two are inside"); }); });
    CHECK(refused.starts_with("this completer is in use by another thread"));
    return 5;
  }) == 5);
  CHECK(message_of([&] { turns.enter([] { throw std::logic_error("mine"); }); }) == "mine");
  CHECK(turns.enter([] { return true; }));
  OneAtATime named("training sequence");
  named.enter([&] {
    CHECK(message_of([&] { named.enter([] {}); }).starts_with("this training sequence is in use"));
  });
}

TEST_CASE("calls from many threads succeed or are refused, and the completer stays valid") {
  const SharedWork pieces(64);
  const auto mesh = sheet<float>(40);
  const auto k = mesh.size();
  const auto frame = turned(mesh.vertices, 0.1);
  const auto known = random_mask(k, 0.2, 5);
  for (const Index threads : {1, 2}) {
    CCompleter<float> shared(mesh.faces(), mesh.points(), {.threads = threads});
    const auto push = [&](auto& completer, std::vector<float>& completed) {
      completer.push({frame.data(), k}, {known.data(), k}, {completed.data(), k});
    };
    const std::uint64_t before = pieces_done_by_others();
    std::atomic<int> pushed{0};
    std::atomic<int> wrong{0};
    const auto is_accepted = [&](const auto& call) {
      try {
        call();
        return true;
      } catch (const std::invalid_argument& error) {
        if (!std::string(error.what()).starts_with("this completer is in use by another")) ++wrong;
        return false;
      }
    };
    in_threads(4, [&](int number) {
      std::vector<float> completed(3 * k);
      dynmesh_topology_report topology;
      for (int i = 0; i < 60; ++i) {
        if (is_accepted([&] { push(shared, completed); })) ++pushed;
        if (number == 0) is_accepted([&] { (void)shared.report(); });
        if (number == 1) is_accepted([&] { (void)shared.state(); });
        if (number == 2) {
          std::int64_t size = 0;  // what follows is never refused
          if (dynmesh_state_size(shared.get(), &size) != DYNMESH_OK) ++wrong;
        }
        if (number == 3 && dynmesh_topology(shared.get(), &topology) != DYNMESH_OK) ++wrong;
        if (shared.age().size() != k || shared.generation().size() != k) ++wrong;
      }
    });
    CHECK(wrong == 0);
    CHECK(pushed > 0);
    CHECK((pieces_done_by_others() > before) == (threads > 1));
    // The state is that which a single thread produces.
    Completer<float> alone(mesh.faces(), mesh.points());
    std::vector<float> completed(3 * k);
    for (int i = 0; i < pushed; ++i) push(alone, completed);
    CHECK(alone.state() == shared.state());
  }
}

template <class Real>
std::vector<Real> complete_alone(const Mesh<Real>& mesh, const Settings& settings) {
  const std::size_t k = mesh.size();
  Completer<Real> completer(mesh.faces(), mesh.points(), settings);
  std::vector<Real> completed(3 * k);
  for (unsigned i = 1; i < 6; ++i) {
    const auto frame = turned(mesh.vertices, 0.03 * i);
    const auto known = random_mask(k, 0.1 + 0.1 * i, i);
    completer.push({frame.data(), k}, {known.data(), k}, {completed.data(), k});
  }
  return completed;
}

TEST_CASE("threads are woken from 24 pieces on") {
  // The size that the settings state.
  Workers workers(2, {.patience = 1'000'000});
  const auto nothing = [](Index, Index) {};
  CHECK(shared_pieces([&] { workers.for_each_chunk(23'552, nothing); }) == 0);
  CHECK(shared_pieces([&] { workers.for_each_chunk(23'553, nothing); }) > 0);
  CHECK(shared_pieces([&] { workers.for_each_short_chunk(23'552, nothing); }) == 0);
  CHECK(shared_pieces([&] { workers.for_each_short_chunk(23'553, nothing); }) > 0);
}

TEST_CASE_TEMPLATE("completers in separate threads are independent", Real, float, double) {
  const SharedWork pieces;
  const auto mesh = sheet<Real>(20);
  for (const Method method : {Method::motion, Method::detail}) {
    Settings settings;
    settings.method = method;
    const auto expected = complete_alone(mesh, settings);
    std::atomic<int> same{0};
    CHECK(shared_pieces([&] {
            in_threads(4, [&](int number) {
              Settings own = settings;
              own.threads = 1 + number % 2;
              if (complete_alone(mesh, own) == expected) ++same;
            });
          }) > 0);
    CHECK(same == 4);
  }
}

}  // namespace
}  // namespace dynmesh::testing
