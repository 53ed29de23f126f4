/// Work that the threads of one object share.
#include "shared_work.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <dynmesh/completer.hpp>
#include <dynmesh/registration.hpp>
#include <dynmesh/tracker.hpp>
#include <stdexcept>
#include <thread>
#include <vector>

#include "base/workers.hpp"
#include "meshes.hpp"
#include "scans.hpp"
#include "training_data.hpp"

namespace dynmesh::testing {
namespace {

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

TEST_CASE("work of more pieces than one ticket counts is executed once") {
  for (const Index count : {1'000'000, 1'048'576 + 5, 2'500'000}) {
    Workers workers(2, in_small_pieces());
    std::vector<std::uint8_t> done(static_cast<std::size_t>(count));
    workers.for_each(count, [&](Index i) { ++done[static_cast<std::size_t>(i)]; });
    CHECK(std::ranges::count(done, 1) == count);
  }
}

using Positions = std::vector<double>;

/// Frame n of a mesh that turns and bends.
Positions moving(const Mesh<double>& mesh, unsigned n) {
  return turned(bent(mesh.vertices, 0.1 * n), 0.05 * n);
}

/// The frames of completers with all settings, and their standard errors.
Positions completed_by(Index threads) {
  const auto mesh = join(bumpy_torus(10), sheet<double>(5, 20));
  const std::size_t k = mesh.size();
  Positions found;
  Positions out(3 * k);
  const auto complete = [&](Completer<double> completer) {
    const auto state = completer.state();
    for (unsigned n = 1; n < 6; ++n) {
      if (n == 3) completer.restore(state);
      if (n == 5) completer.reset({out.data(), k});
      const auto frame = moving(mesh, n);
      const auto known = random_mask(k, n == 4 ? 0.02 : 0.3, n);
      completer.push({frame.data(), k}, {known.data(), k}, {out.data(), k});
      found.insert(found.end(), out.begin(), out.end());
    }
    if (completer.settings().uncertainty)
      std::ranges::copy(completer.standard_error(), std::back_inserter(found));
  };
  for (Settings settings :
       {Settings{.method = Method::motion}, Settings{.method = Method::motion, .revisit = false},
        Settings{.method = Method::motion, .extra_iterations = 5}, Settings{.uncertainty = true},
        Settings{.noise = 0.02, .reject_outliers = true}, Settings{.learn = true}}) {
    settings.threads = threads;
    complete({mesh.faces(), mesh.points(), settings});
  }
  complete(trained(mesh, {.threads = threads}));
  return found;
}

/// The frames of trackers with all settings, their standard errors, and a registration.
Positions tracked_by(Index threads) {
  const auto mesh = bumpy_torus(12);
  const std::size_t k = mesh.size();
  Positions found;
  Positions out(3 * k);
  const auto follow = [&](Tracker<double> tracker) {
    for (unsigned n = 1; n < 5; ++n) {
      const auto truth = moving(mesh, n == 4 && tracker.settings().recover ? 40 : n);
      if (n == 3) {
        const auto images = images_of(mesh, truth, 2, 40);
        const std::array views = {images[0].view(), images[1].view()};
        tracker.push_depth(views, {out.data(), k});
      } else {
        out = track(tracker, scan_of(mesh, truth));
      }
      found.insert(found.end(), out.begin(), out.end());
    }
    if (tracker.settings().uncertainty)
      std::ranges::copy(tracker.standard_error(), std::back_inserter(found));
  };
  follow({mesh.faces(), mesh.points(), {.threads = threads, .recover = true}});
  follow({mesh.faces(), mesh.points(), {.threads = threads, .resolution = 60}});
  follow({mesh.faces(),
          mesh.points(),
          {.threads = threads, .uncertainty = true},
          training_of(training_frames_of(mesh.vertices, 5))});
  const auto scan = scan_of(mesh, translated(turned(mesh.vertices, 2.0), 30.0, -14.0, 5.0));
  const auto result = register_template<double>(mesh.faces(), mesh.points(), view_of(scan), {},
                                                {.threads = threads});
  found.insert(found.end(), result.vertices.begin(), result.vertices.end());
  return found;
}

TEST_CASE("results do not depend on threads, nor on the size and the order of their pieces") {
  const SharedWork restores_the_default;
  for (const auto results_by : {&completed_by, &tracked_by}) {
    default_task_sharing() = {};
    const Positions usual = results_by(1);
    default_task_sharing() = in_small_pieces(8);
    const Positions expected = results_by(1);
    Positions found;
    CHECK(shared_pieces([&] { found = results_by(3); }) > 0);
    CHECK(found == expected);
    default_task_sharing().backwards = true;
    CHECK(results_by(1) == expected);
    REQUIRE(usual.size() == expected.size());
    // The sums of other pieces differ in their last digits, and iterations that end at a share of
    // the error may then end at another one.
    double largest = 0;
    for (std::size_t i = 0; i < usual.size(); ++i) {
      largest = std::max(largest, std::abs(usual[i] - expected[i]));
    }
    CHECK(largest < 5e-4);
  }
}

}  // namespace
}  // namespace dynmesh::testing
