/// Work that threads share, and objects that several threads use.
#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <dynmesh/completer.hpp>
#include <dynmesh/registration.hpp>
#include <dynmesh/tracker.hpp>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include "api/one_at_a_time.hpp"
#include "api/published.hpp"
#include "base/workers.hpp"
#include "c_completer.hpp"
#include "meshes.hpp"
#include "scans.hpp"
#include "shared_work.hpp"
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
      for (int i = 0; i < 60; ++i) {
        if (is_accepted([&] { push(shared, completed); })) ++pushed;
        if (number == 1) is_accepted([&] { (void)shared.state(); });
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

TEST_CASE("a published value is read whole, and never an earlier one after a later one") {
  struct Numbers {
    std::array<std::uint64_t, 90> numbers{};
  };
  Published<Numbers> published;
  std::atomic<bool> is_over{false};
  std::atomic<int> wrong{0};
  std::vector<std::thread> readers;
  for (int i = 0; i < 2; ++i) {
    readers.emplace_back([&] {
      for (std::uint64_t last = 0; !is_over;) {
        const auto now = published.get().numbers;
        if (now.front() != now.back() || now.front() < last) ++wrong;
        last = now.front();
      }
    });
  }
  Numbers value;
  for (std::uint64_t n = 1; n < 100'000; ++n) {
    value.numbers.fill(n);
    published.set(value);
    if (n % 1000 == 0) std::this_thread::yield();
  }
  is_over = true;
  for (auto& reader : readers) reader.join();
  CHECK(wrong == 0);
  CHECK(published.get().numbers == value.numbers);
}

/// Two components, and a face that no half-edge mesh holds.
Mesh<double> partly_refused() {
  auto mesh = join(bumpy_torus(8), sheet<double>(4, 20));
  mesh.indices.insert(mesh.indices.end(), {0, 0, 1});
  return mesh;
}

/// Calls `change(i)` for rising i, while two threads call `is_right()` again and again. Returns how
/// often it was not.
template <class Change, class IsRight>
int wrong_during(int n_changes, const Change& change, const IsRight& is_right) {
  std::atomic<bool> is_over{false};
  std::atomic<int> wrong{0};
  std::atomic<int> begun{0};
  const auto watch = [&] {
    ++begun;
    while (!is_over) wrong += is_right() ? 0 : 1;
  };
  std::vector<std::thread> watchers;
  for (int i = 0; i < 2; ++i) watchers.emplace_back(watch);
  while (begun < 2) std::this_thread::yield();
  for (int i = 0; i < n_changes; ++i) change(i);
  is_over = true;
  for (auto& watcher : watchers) watcher.join();
  return wrong;
}

/// Whether everything that may be called at any time tells what it should.
template <class Stream>
bool is_told_at_any_time(const Stream& stream, std::size_t k, std::size_t state_size) {
  const TopologyReport& topology = stream.topology();
  const auto report = stream.report();
  return stream.n_vertices() == k && stream.n_edges() > k && stream.state_size() == state_size &&
         topology.components == 2 && topology.refused_faces.size() == 1 &&
         topology.refused_faces.front().reason.starts_with("degenerate") &&
         stream.settings().threads == 1 && stream.n_frames() < 100 &&
         report.known + report.filled + report.disconnected == k &&
         (report.quality == Quality::good) == (report.reason[0] == 0);
}

/// Changes a stream in all ways in turn: `push` adds a frame.
template <class Stream, class Real, class Push>
void change(Stream& stream, const Mesh<Real>& mesh, const std::vector<std::byte>& state,
            const Push& push, int i) {
  const auto moved = translated(mesh.vertices, Real{0.01}, Real{0}, Real{0});
  if (i % 4 == 0) stream.reset({(i % 8 == 0 ? moved : mesh.vertices).data(), mesh.size()});
  if (i % 4 == 1 || i % 4 == 3) push(i);
  if (i % 4 == 2) stream.restore(state);
}

TEST_CASE("what may be called at any time is right while the object changes") {
  const auto mesh = partly_refused();
  const std::size_t k = mesh.size();
  std::vector<double> out(3 * k);
  const Points<double> rows(out.data(), k);
  SUBCASE("of a completer") {
    for (const Method method : {Method::motion, Method::detail}) {
      Completer<double> completer(mesh.faces(), mesh.points(), {.method = method});
      const auto push = [&](int i) {
        const auto known = random_mask(k, 0.1 * (i % 10), static_cast<unsigned>(i));
        completer.push(mesh.points(), {known.data(), k}, rows);
      };
      push(1);
      const auto state = completer.state();
      const int wrong = wrong_during(
          200, [&](int i) { change(completer, mesh, state, push, i); },
          [&] { return is_told_at_any_time(completer, k, state.size()); });
      CHECK(wrong == 0);
    }
  }
  SUBCASE("of a tracker") {
    Tracker<double> tracker(mesh.faces(), mesh.points());
    const auto scan = scan_of(mesh, mesh.vertices);
    const auto push = [&](int i) {
      i % 3 == 0 ? (void)tracker.skip(rows) : (void)track(tracker, scan);
    };
    push(1);
    const auto state = tracker.state();
    const int wrong = wrong_during(
        24, [&](int i) { change(tracker, mesh, state, push, i); },
        [&] { return is_told_at_any_time(tracker, k, state.size()); });
    CHECK(wrong == 0);
  }
  SUBCASE("in C") {
    CCompleter<double> completer(mesh.faces(), mesh.points());
    const auto push = [&](int i) {
      const auto known = random_mask(k, 0.1 * (i % 10), static_cast<unsigned>(i));
      completer.push(mesh.points(), {known.data(), k}, rows);
    };
    push(1);
    const auto state = completer.state();
    const auto is_right = [&] {
      std::int64_t size = 0;
      dynmesh_frame_report report;
      return dynmesh_n_vertices(completer.get()) == static_cast<std::int64_t>(k) &&
             dynmesh_state_size(completer.get(), &size) == DYNMESH_OK &&
             size == std::ssize(state) && dynmesh_report(completer.get(), &report) == DYNMESH_OK &&
             report.known + report.filled + report.disconnected == static_cast<std::int64_t>(k);
    };
    CHECK(wrong_during(
              100, [&](int i) { change(completer, mesh, state, push, i); }, is_right) == 0);
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
    double largest = 0;  // as the sums of other pieces differ in their last digits
    for (std::size_t i = 0; i < usual.size(); ++i) {
      largest = std::max(largest, std::abs(usual[i] - expected[i]));
    }
    CHECK(largest < 1e-4);
  }
}

}  // namespace
}  // namespace dynmesh::testing
