/// Tests several threads: on one completer, which refuses all but one of them, and on separate
/// completers. Should also be run with the thread sanitizer: -DDYNMESH_SANITIZE=thread.
#include <doctest/doctest.h>
#include <dynmesh/dynmesh.h>

#include <algorithm>
#include <atomic>
#include <dynmesh/completer.hpp>
#include <string>
#include <thread>
#include <vector>

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

struct Shared {
  explicit Shared(const Mesh<float>& mesh, Index threads) : mesh_(mesh) {
    dynmesh_settings settings;
    REQUIRE(dynmesh_default_settings(&settings, sizeof settings) == DYNMESH_OK);
    settings.threads = threads;
    const dynmesh_points first = {mesh.vertices.data(), static_cast<std::int64_t>(mesh.size()), 3,
                                  1, DYNMESH_FLOAT32};
    const auto n_faces = static_cast<std::int64_t>(mesh.faces().count);
    REQUIRE(dynmesh_create(mesh.indices.data(), n_faces, &first, &settings, &completer) ==
            DYNMESH_OK);
  }
  ~Shared() { dynmesh_destroy(completer); }
  Shared(const Shared&) = delete;
  Shared& operator=(const Shared&) = delete;

  dynmesh_status push(const std::vector<float>& frame, const std::vector<std::uint8_t>& known,
                      std::vector<float>& completed) const {
    const auto k = static_cast<std::int64_t>(mesh_.size());
    const dynmesh_points points = {frame.data(), k, 3, 1, DYNMESH_FLOAT32};
    const dynmesh_mask mask = {known.data(), k, 1};
    const dynmesh_output out = {completed.data(), k, 3, 1, DYNMESH_FLOAT32};
    return dynmesh_push(completer, &points, &mask, &out, nullptr);
  }

  dynmesh_completer* completer = nullptr;

 private:
  const Mesh<float>& mesh_;
};

TEST_CASE("calls from many threads succeed or are refused, and the completer stays valid") {
  const SharedWork pieces(64);
  const auto mesh = sheet<float>(40);
  const auto k = mesh.size();
  const auto frame = turned(mesh.vertices, 0.1);
  const auto known = random_mask(k, 0.2, 5);
  for (const Index threads : {1, 2}) {
    const Shared shared(mesh, threads);
    const std::uint64_t before = pieces_done_by_others();
    std::atomic<int> pushed{0};
    std::atomic<int> wrong{0};
    const auto expect = [&](dynmesh_status status) {
      const bool refused =
          status == DYNMESH_IN_USE &&
          std::string(dynmesh_last_message()).starts_with("this completer is in use by another");
      if (status != DYNMESH_OK && !refused) ++wrong;
      return status == DYNMESH_OK;
    };
    in_threads(4, [&](int number) {
      std::vector<float> completed(3 * k);
      std::vector<std::byte> state(200 + 100 * k);
      dynmesh_frame_report report;
      dynmesh_topology_report topology;
      for (int i = 0; i < 60; ++i) {
        if (expect(shared.push(frame, known, completed))) ++pushed;
        if (number == 0) {
          expect(dynmesh_report(shared.completer, &report));
        } else if (number == 1) {
          const auto size = static_cast<std::int64_t>(state.size());
          expect(dynmesh_state(shared.completer, state.data(), size));
        } else if (number == 2) {
          (void)dynmesh_generation(shared.completer);
          (void)dynmesh_age(shared.completer);
          std::int64_t size = 0;  // never refused
          if (dynmesh_state_size(shared.completer, &size) != DYNMESH_OK) ++wrong;
        } else if (dynmesh_topology(shared.completer, &topology) != DYNMESH_OK ||
                   dynmesh_n_vertices(shared.completer) != static_cast<std::int64_t>(k)) {
          ++wrong;
        }
      }
    });
    CHECK(wrong == 0);
    CHECK(pushed > 0);
    CHECK((pieces_done_by_others() > before) == (threads > 1));
    // The state is that which a single thread produces.
    Completer<float> alone(mesh.faces(), mesh.points());
    std::vector<float> expected(3 * k);
    std::vector<float> completed(3 * k);
    const auto push_alone = [&] {
      alone.push({frame.data(), k}, {known.data(), k}, {expected.data(), k});
    };
    for (int i = 0; i < pushed; ++i) push_alone();
    CHECK(std::equal(alone.age().begin(), alone.age().end(), dynmesh_age(shared.completer)));
    push_alone();
    CHECK(shared.push(frame, known, completed) == DYNMESH_OK);
    CHECK(completed == expected);
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
  // The sizes that docs/results.md and the settings state: 23 553 vertices with motion, 5 889 with
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
