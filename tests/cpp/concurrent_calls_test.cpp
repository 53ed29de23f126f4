/// Objects that several threads use.
#include <doctest/doctest.h>

#include <array>
#include <atomic>
#include <dynmesh/completer.hpp>
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
