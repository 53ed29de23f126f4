#include "generations/generations.hpp"

#include <doctest/doctest.h>

#include <algorithm>

#include "meshes.hpp"

namespace dynmesh::testing {
namespace {

/// The classification as described in the paper: each iteration visits every vertex.
std::vector<Index> plain_generations(const Cells& cells, const std::vector<std::uint8_t>& known) {
  std::vector<Index> generation(known.size());
  for (std::size_t v = 0; v < known.size(); ++v) generation[v] = known[v] != 0 ? 0 : -1;
  for (Index t = 1;; ++t) {
    const std::vector<Index> before = generation;
    for (std::size_t v = 0; v < known.size(); ++v) {
      const auto cell = cells[static_cast<Index>(v)];
      const bool reached = std::ranges::any_of(cell, [&](Index n) { return before[n] >= 0; });
      if (before[v] < 0 && reached) generation[v] = t;
    }
    if (generation == before) return generation;
  }
}

TEST_CASE("the generation of a satellite is the iteration that reaches it") {
  const auto mesh = join(sheet<float>(9), sheet<float>(4));
  const Topology topology = build_topology(mesh.faces(), mesh.size());
  Generations generations(mesh.size());
  for (unsigned seed = 0; seed < 30; ++seed) {
    const auto known = random_mask(mesh.size(), 0.002 * seed * seed, seed);
    generations.classify(topology.cells, known);
    const auto expected = plain_generations(topology.cells, known);
    CHECK(std::ranges::equal(generations.of_vertices(), expected));
    CHECK(generations.last() == std::max(0, *std::ranges::max_element(expected)));

    const auto satellites = generations.satellites();
    CHECK(std::ranges::is_sorted(satellites, {}, [&](Index v) { return expected[v]; }));
    for (Index t = 0; t <= generations.last() + 1; ++t) {
      const auto reached =
          std::ranges::count_if(expected, [&](Index g) { return 1 <= g && g <= t; });
      CHECK(generations.reached_by(t) == static_cast<std::size_t>(reached));
    }
    CHECK(generations.anchors() + satellites.size() + generations.disconnected_vertices() ==
          mesh.size());
    CHECK(generations.disconnected_vertices() ==
          static_cast<std::size_t>(std::ranges::count(expected, -1)));
  }
}

}  // namespace
}  // namespace dynmesh::testing
