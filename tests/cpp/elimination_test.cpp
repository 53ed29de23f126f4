#include "factor/elimination.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <cstdlib>
#include <functional>
#include <numeric>
#include <random>
#include <vector>

#include "factor/subtrees.hpp"

namespace dynmesh::testing {
namespace {

/// The graph of a square grid of n by n columns, with edges to the eight around each.
SymmetricMatrix grid(Index n) {
  SymmetricMatrix matrix;
  matrix.offsets.push_back(0);
  for (Index y = 0; y < n; ++y) {
    for (Index x = 0; x < n; ++x) {
      for (Index j = std::max(0, y - 1); j <= std::min(n - 1, y + 1); ++j) {
        for (Index i = std::max(0, x - 1); i <= std::min(n - 1, x + 1); ++i) {
          matrix.rows.push_back(j * n + i);
          matrix.values.push_back(i == x && j == y ? 9 : -1);
        }
      }
      matrix.offsets.push_back(static_cast<Index>(matrix.rows.size()));
    }
  }
  return matrix;
}

/// The number of multiplications of a factorisation of the whole matrix.
std::vector<double> work_of(const Elimination& plan) {
  std::vector<double> work;
  for (std::size_t s = 0; s < plan.parents.size(); ++s) {
    const double columns = plan.firsts[s + 1] - plan.firsts[s];
    const double rows = columns + plan.row_offsets[s + 1] - plan.row_offsets[s];
    work.push_back(columns * rows * rows);
  }
  return work;
}

TEST_CASE("orders are permutations, and the same in every call") {
  for (const Index n : {1, 2, 30}) {
    const SymmetricMatrix matrix = grid(n);
    for (const Ordering ordering : {Ordering::minimum_degree, Ordering::nested_dissection}) {
      const auto order = elimination_order(matrix, ordering);
      auto sorted = order;
      std::ranges::sort(sorted);
      std::vector<Index> all(matrix.size());
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
  const auto operations = [](const SymmetricMatrix& matrix, Ordering ordering) {
    const auto work = work_of(plan_elimination(matrix, ordering));
    return std::accumulate(work.begin(), work.end(), 0.0);
  };
  const SymmetricMatrix large = grid(180);
  REQUIRE(best_ordering(large.size()) == Ordering::nested_dissection);
  CHECK(best_ordering(10'000) == Ordering::minimum_degree);
  CHECK(operations(large, Ordering::nested_dissection) <
        operations(large, Ordering::minimum_degree));
}

TEST_CASE("subtrees are independent, of limited work, and divided into groups") {
  for (const Ordering ordering : {Ordering::minimum_degree, Ordering::nested_dissection}) {
    const Elimination plan = plan_elimination(grid(40), ordering);
    Subtrees subtrees(plan);
    CHECK(subtrees.n_groups() == 0);
    for (const unsigned seed : {0U, 1U, 2U}) {
      std::vector<double> work = work_of(plan);
      std::mt19937 random(seed);
      if (seed > 0) {  // as with a mask that leaves nothing of some supernodes
        for (double& one : work) one *= random() % 3;
      }
      const double all = std::accumulate(work.begin(), work.end(), 0.0);
      auto of_subtrees = work;
      subtrees.divide(of_subtrees);
      REQUIRE(subtrees.all().size() > 4);
      std::vector<Index> subtree_of(work.size(), -1);
      Index before = -1;
      for (std::size_t i = 0; i < subtrees.all().size(); ++i) {
        const auto [first, root] = subtrees.all()[i];
        CHECK(first > before);
        before = root;
        double sum = 0;
        for (Index s = first; s <= root; ++s) {
          subtree_of[static_cast<std::size_t>(s)] = static_cast<Index>(i);
          sum += work[static_cast<std::size_t>(s)];
        }
        CHECK(sum <= 0.1 * all * (1 + 1e-9));
      }
      for (std::size_t s = 0; s < work.size(); ++s) {
        // A supernode contributes to those above it, which are all in its subtree or in none.
        for (Index up = plan.parents[s]; up >= 0; up = plan.parents[static_cast<std::size_t>(up)]) {
          const Index there = subtree_of[static_cast<std::size_t>(up)];
          CHECK((there == -1 || there == subtree_of[s]));
        }
      }
      CHECK(subtrees.groups().front() == 0);
      CHECK(subtrees.groups().back() == std::ssize(subtrees.all()));
      CHECK(std::ranges::adjacent_find(subtrees.groups(), std::greater_equal{}) ==
            subtrees.groups().end());
    }
    subtrees.clear();
    CHECK(subtrees.all().empty());
    CHECK(subtrees.n_groups() == 0);
  }
}

}  // namespace
}  // namespace dynmesh::testing
