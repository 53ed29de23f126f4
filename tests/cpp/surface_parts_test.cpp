#include "detail/surface_parts.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "meshes.hpp"

namespace dynmesh::testing {
namespace {

std::vector<Vector3<double>> rows_of(const std::vector<double>& vertices) {
  std::vector<Vector3<double>> rows;
  for (std::size_t i = 0; i < vertices.size(); i += 3) {
    rows.push_back({vertices[i], vertices[i + 1], vertices[i + 2]});
  }
  return rows;
}

SurfaceParts parts_of(const Mesh<double>& mesh, const TrainingConstants& constants = {}) {
  const Topology topology = build_topology(mesh.faces(), mesh.size());
  return divide_surface(topology.cells, rows_of(mesh.vertices), constants);
}

std::span<const SurfaceParts::Entry> at(const SurfaceParts& parts, std::size_t v) {
  return std::span(parts.entries)
      .subspan(parts.offsets[v], parts.offsets[v + 1] - parts.offsets[v]);
}

/// Checks what holds for every mesh, and returns the number of vertices with local parts.
std::size_t check(const SurfaceParts& parts, std::size_t k) {
  REQUIRE(parts.offsets.size() == k + 1);
  REQUIRE(parts.offsets.front() == 0);
  REQUIRE(static_cast<std::size_t>(parts.offsets.back()) == parts.entries.size());
  std::size_t n_local = 0;
  for (std::size_t v = 0; v < k; ++v) {
    const auto entries = at(parts, v);
    REQUIRE(!entries.empty());
    CHECK(entries[0].part == 0);
    CHECK(entries[0].weight == 1);
    double sum = 0;
    for (std::size_t e = 1; e < entries.size(); ++e) {
      CHECK(entries[e].part > entries[e - 1].part);
      CHECK(entries[e].part < parts.n_parts);
      CHECK(entries[e].weight >= 0.02);
      sum += entries[e].weight;
    }
    if (entries.size() > 1) {
      ++n_local;
      CHECK(sum == doctest::Approx(1).epsilon(1e-12));
    }
  }
  return n_local;
}

TEST_CASE("the weights of the parts add up to one, and decrease from the seed") {
  for (const Mesh<double>& mesh : {sheet<double>(20), torus(20)}) {
    const std::size_t k = mesh.size();
    const SurfaceParts parts = parts_of(mesh);
    CHECK(parts.n_parts == 13);
    CHECK(check(parts, k) == k);
    std::set<Index> found;
    std::size_t most = 0;
    for (const auto& entry : parts.entries) found.insert(entry.part);
    for (std::size_t v = 0; v < k; ++v) most = std::max(most, at(parts, v).size());
    CHECK(found.size() == 13);
    CHECK(most < 13);  // they are local
    CHECK(most > 2);   // and overlap
  }
}

TEST_CASE("the first seed is farthest from the mean, and has the largest weight of its part") {
  auto mesh = sheet<double>(10);
  mesh.vertices[3 * 99 + 2] += 3;
  const SurfaceParts parts = parts_of(mesh);
  double largest = 0;
  std::size_t seed = 0;
  for (std::size_t v = 0; v < mesh.size(); ++v) {
    for (const auto& entry : at(parts, v)) {
      if (entry.part == 1 && entry.weight > largest) {
        largest = entry.weight;
        seed = v;
      }
    }
  }
  CHECK(seed == 99);
}

TEST_CASE("parts do not reach across components") {
  const auto mesh = join(sheet<double>(8), sheet<double>(8, 7.1));
  const SurfaceParts parts = parts_of(mesh);
  CHECK(check(parts, mesh.size()) == mesh.size());
  std::set<Index> one;
  std::set<Index> two;
  for (std::size_t v = 0; v < mesh.size(); ++v) {
    for (const auto& entry : at(parts, v).subspan(1)) (v < 64 ? one : two).insert(entry.part);
  }
  CHECK(one.size() + two.size() == 12);
  CHECK(!one.empty());
  CHECK(!two.empty());
  for (const Index part : one) CHECK(!two.contains(part));
}

TEST_CASE("what no seed reaches has the global part alone") {
  TrainingConstants one_seed;
  one_seed.local_parts = 1;
  auto mesh = join(sheet<double>(8), sheet<double>(3, 100));
  // A single seed has no second nearest one, so there is no typical distance.
  CHECK(parts_of(mesh, one_seed).n_parts == 1);
  one_seed.local_parts = 2;
  mesh = join(sheet<double>(12), sheet<double>(2, 5));  // both seeds on the first sheet
  const SurfaceParts parts = parts_of(mesh, one_seed);
  CHECK(parts.n_parts == 3);
  CHECK(check(parts, mesh.size()) == 144);
}

TEST_CASE("degenerate meshes are divided as well") {
  Mesh<double> mesh;
  SUBCASE("one vertex") { mesh = {{1, 2, 3}, {0, 0, 0}}; }
  SUBCASE("all vertices coincide") {
    mesh = sheet<double>(4);
    std::ranges::fill(mesh.vertices, 1.0);
  }
  SUBCASE("no edges") {
    mesh = sheet<double>(4);
    mesh.indices = {0, 0, 0};
  }
  const SurfaceParts parts = parts_of(mesh);
  CHECK(parts.n_parts == 1);
  CHECK(check(parts, mesh.size()) == 0);
}

TEST_CASE("two vertices have two parts") {
  const Mesh<double> mesh = {{0, 0, 0, 1, 0, 0}, {0, 1, 1}};
  const SurfaceParts parts = parts_of(mesh);
  CHECK(parts.n_parts == 3);
  CHECK(check(parts, 2) == 2);
  CHECK(at(parts, 0)[1].weight == doctest::Approx(at(parts, 1)[2].weight));
}

}  // namespace
}  // namespace dynmesh::testing
