#include "support/workers.hpp"

#include <doctest/doctest.h>

#include <atomic>
#include <thread>
#include <vector>

#include "shared_work.hpp"

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

TEST_CASE("threads end with their owner, whether or not they were used") {
  for (int i = 0; i < 50; ++i) {
    Workers workers(3, in_small_pieces());
    if (i % 2 == 0) workers.for_each(7, [](Index) {});
  }
}

}  // namespace
}  // namespace dynmesh::testing
