/// Tests several threads: on one completer, which refuses all but one of them, and on separate
/// completers. Should also be run with the thread sanitizer: -DDYNMESH_SANITIZE=thread.
#include <doctest/doctest.h>

#include <atomic>
#include <dynmesh/completer.hpp>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include "c_completer.hpp"
#include "meshes.hpp"
#include "shared_work.hpp"
#include "stream/one_at_a_time.hpp"

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
  // The sizes that the settings state: 23 553 vertices with motion, 5 889 with
  // detail.
  Workers workers(2, {.patience = 100'000'000});
  const auto nothing = [](Index, Index) {};
  CHECK(shared_pieces([&] { workers.for_each_chunk(23'552, nothing); }) == 0);
  CHECK(shared_pieces([&] { workers.for_each_chunk(23'553, nothing); }) > 0);
  CHECK(shared_pieces([&] { workers.for_each_short_chunk(5'888, nothing); }) == 0);
  CHECK(shared_pieces([&] { workers.for_each_short_chunk(5'889, nothing); }) > 0);
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
