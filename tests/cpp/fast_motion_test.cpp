#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "meshes.hpp"
#include "motion/motion.hpp"
#include "shared_work.hpp"

namespace dynmesh::testing {
namespace {

/// Random faces, mostly between nearby vertices, and one vertex that is connected to half the mesh.
Topology random_mesh(std::mt19937& random, std::size_t k) {
  std::uniform_int_distribution<Index> vertex(0, static_cast<Index>(k) - 1);
  std::uniform_int_distribution<Index> step(1, 3);
  std::vector<Index> indices;
  for (std::size_t face = 0; face < k; ++face) {
    const Index a = vertex(random);
    const auto last = static_cast<Index>(k) - 1;
    for (const Index corner : {a, std::min(a + step(random), last), std::min(a + 4, last)}) {
      indices.push_back(corner);
    }
  }
  for (Index v = 1; v + 1 < static_cast<Index>(k) / 2; v += 2) {
    for (const Index corner : {0, v, v + 1}) indices.push_back(corner);
  }
  return build_topology(faces_of(indices), k);
}

/// Algorithm 1 of the paper. Every iteration estimates all satellites that were reached.
template <class Real>
Index complete_plainly(const Cells& cells, const std::vector<Vector3<Real>>& previous,
                       std::vector<Vector3<Real>>& points, std::span<const std::uint8_t> known,
                       Index extra_iterations, Generations& generations) {
  generations.classify(cells, known);
  const auto generation = generations.of_vertices();
  const Real h = mean_edge_length<Real>(cells, previous);
  std::vector<Vector3<Real>> motions(points.size());
  for (std::size_t v = 0; v < points.size(); ++v) {
    if (known[v] != 0) motions[v] = points[v] - previous[v];
  }
  const Index iterations = generations.last() + extra_iterations;
  for (Index t = 1; t <= iterations; ++t) {
    const auto before = motions;
    for (const Index j : generations.satellites()) {
      if (generation[j] > t) break;
      Vector3<Real> sum;
      Real weights{};
      for (const Index i : cells[j]) {
        if (generation[i] >= t) continue;
        const Real square = squared_norm(Real{1} / h * (previous[i] - previous[j]));
        const Real weight = static_cast<Real>(t - generation[i]) /
                            std::clamp(square, static_cast<Real>(1e-12), static_cast<Real>(1e24));
        sum = sum + weight * before[i];
        weights += weight;
      }
      motions[j] = Real{1} / weights * sum;
      points[j] = previous[j] + motions[j];
    }
  }
  return iterations;
}

template <class Real>
void check_against_plain(Real tolerance, std::size_t k, Index extra_iterations, double share,
                         unsigned seed) {
  std::mt19937 random(seed);
  std::normal_distribution<Real> normal;
  std::bernoulli_distribution is_known(share);
  const Topology topology = random_mesh(random, k);
  std::vector<Vector3<Real>> previous(k);
  std::vector<Vector3<Real>> points(k);
  std::vector<std::uint8_t> known(k);
  for (std::size_t v = 0; v < k; ++v) {
    previous[v] = {static_cast<Real>(v) + normal(random), normal(random), normal(random)};
    points[v] = {previous[v].x + normal(random), normal(random), normal(random)};
    known[v] = is_known(random) ? 1 : 0;
  }
  auto expected = points;
  Generations generations(k);
  const Index iterations = complete_plainly<Real>(topology.cells, previous, expected, known,
                                                  extra_iterations, generations);

  const Index piece = std::max(4, static_cast<Index>(k) / 20);
  Workers workers(2, in_small_pieces(piece));
  const std::uint64_t before = pieces_done_by_others();
  for (const Kernels& level : runnable_kernels()) {
    const Sweeps<Real>& sweeps = level.sweeps<Real>();
    Motion<Real> fast(topology.cells, previous, extra_iterations, workers, sweeps);
    for (int repeat = 0; repeat < 2; ++repeat) {  // the second frame must not depend on the first
      auto completed = points;
      Generations found(k);
      CHECK(fast.estimate(previous, completed, known, found) == iterations);
      CHECK(std::ranges::equal(found.of_vertices(), generations.of_vertices()));
      CHECK(found.anchors() == generations.anchors());
      CHECK(found.reached() == generations.reached());
      CHECK(found.disconnected_vertices() == generations.disconnected_vertices());
      Real largest{};
      for (std::size_t v = 0; v < k; ++v) {
        if (found.of_vertices()[v] == Generations::disconnected) continue;
        const auto error = std::sqrt(squared_norm(completed[v] - expected[v]));
        largest = std::max(largest, error / (1 + std::sqrt(squared_norm(expected[v]))));
      }
      CHECK(largest <= tolerance);
    }
  }
  CHECK((pieces_done_by_others() > before) == (static_cast<Index>(k) > piece));
}

TEST_CASE("the loops agree with a literal version, for every kind of processor") {
  constexpr Index extras[] = {0, 1, 7};
  unsigned seed = 0;
  for (const std::size_t k : {1, 2, 5, 30, 300, 3000}) {
    for (const double share : {0.0, 0.001, 0.1, 0.5, 0.9, 1.0}) {
      const Index extra = extras[(seed + seed / 6) % 3];  // each share has every number
      CAPTURE(k);
      CAPTURE(share);
      CAPTURE(extra);
      check_against_plain<float>(5e-6F, k, extra, share, ++seed);
      check_against_plain<double>(1e-12, k, extra, share, seed);
    }
  }
}

}  // namespace
}  // namespace dynmesh::testing
