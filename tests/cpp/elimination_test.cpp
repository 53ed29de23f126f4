#include "factor/elimination.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <cstdlib>
#include <numeric>
#include <vector>

namespace dynmesh::testing {
namespace {

/// The graph of a square grid of n by n columns, with edges to the eight around each.
SparseMatrix grid(Index n) {
  std::vector<Eigen::Triplet<double, Index>> entries;
  for (Index y = 0; y < n; ++y) {
    for (Index x = 0; x < n; ++x) {
      for (Index j = std::max(0, y - 1); j <= std::min(n - 1, y + 1); ++j) {
        for (Index i = std::max(0, x - 1); i <= std::min(n - 1, x + 1); ++i) {
          entries.emplace_back(j * n + i, y * n + x, i == x && j == y ? 9 : -1);
        }
      }
    }
  }
  SparseMatrix matrix(n * n, n * n);
  matrix.setFromTriplets(entries.begin(), entries.end());
  return matrix;
}

TEST_CASE("orders are permutations, and the same in every call") {
  for (const Index n : {1, 2, 30}) {
    const SparseMatrix matrix = grid(n);
    for (const Ordering ordering : {Ordering::minimum_degree, Ordering::nested_dissection}) {
      const auto order = elimination_order(matrix, ordering);
      auto sorted = order;
      std::ranges::sort(sorted);
      std::vector<Index> all(matrix.cols());
      std::iota(all.begin(), all.end(), Index{0});
      CHECK(sorted == all);
      std::srand(7);  // METIS takes its random numbers from rand
      (void)std::rand();
      CHECK(elimination_order(matrix, ordering) == order);
    }
  }
}

TEST_CASE("nested dissection takes fewer operations where it is chosen") {
  if (!has_nested_dissection()) return;
  const auto operations = [](const SparseMatrix& matrix, Ordering ordering) {
    const Elimination plan = plan_elimination(matrix, ordering);
    double sum = 0;
    for (std::size_t s = 0; s < plan.parents.size(); ++s) {
      const double columns = plan.firsts[s + 1] - plan.firsts[s];
      const double rows = columns + plan.row_offsets[s + 1] - plan.row_offsets[s];
      sum += columns * rows * rows;
    }
    return sum;
  };
  const SparseMatrix large = grid(180);
  REQUIRE(best_ordering(large.cols()) == Ordering::nested_dissection);
  CHECK(best_ordering(10'000) == Ordering::minimum_degree);
  CHECK(operations(large, Ordering::nested_dissection) <
        operations(large, Ordering::minimum_degree));
}

}  // namespace
}  // namespace dynmesh::testing
