#include "support/workers.hpp"

#include <doctest/doctest.h>

#include <atomic>
#include <vector>

namespace dynmesh::testing {
namespace {

TEST_CASE("every piece is done once, and all before the call returns") {
  for (const Index threads : {1, 2, 5}) {
    Workers workers(threads);
    for (int call = 0; call < 3000; ++call) {
      const Index count = call % 80;
      std::vector<std::atomic<int>> done(static_cast<std::size_t>(count));
      workers.for_each(count, [&](Index i) { ++done[static_cast<std::size_t>(i)]; });
      for (const auto& times : done) REQUIRE(times == 1);
    }
  }
}

TEST_CASE("threads end with their owner, used or not") {
  for (int i = 0; i < 50; ++i) {
    Workers workers(3);
    if (i % 2 == 0) workers.for_each(7, [](Index) {});
  }
}

}  // namespace
}  // namespace dynmesh::testing
