#include <doctest/doctest.h>

#include <cstddef>
#include <vector>

#include "detail/modes.hpp"
#include "meshes.hpp"

namespace dynmesh::testing {
namespace {

SurfaceParts parts_of(const Mesh<double>& mesh, const TrainingConstants& constants = {}) {
  const Topology topology = build_topology(mesh.faces(), mesh.size());
  return divide_surface(topology.cells, rows_of(mesh.vertices), constants);
}

/// The number of vertices with local parts.
std::size_t n_local(const SurfaceParts& parts, std::size_t k) {
  REQUIRE(parts.offsets.size() == k + 1);
  std::size_t n = 0;
  for (std::size_t v = 0; v < k; ++v) n += parts.offsets[v + 1] - parts.offsets[v] > 1 ? 1 : 0;
  return n;
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
  CHECK(n_local(parts, mesh.size()) == 144);
}

}  // namespace
}  // namespace dynmesh::testing
