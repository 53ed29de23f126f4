/// Training sequences, and the parts of a surface that have modes of their own. The modes are
/// compared with a transcription by the tests of Python.
#include <doctest/doctest.h>

#include <algorithm>
#include <cstddef>
#include <dynmesh/training.hpp>
#include <limits>
#include <stdexcept>
#include <vector>

#include "meshes.hpp"
#include "shape/modes.hpp"
#include "training_data.hpp"

namespace dynmesh::testing {
namespace {

TEST_CASE("of many frames, those at regular intervals are kept") {
  Training<float> training(1);
  for (std::size_t n = 1; n <= 1300; ++n) {
    const float x[] = {static_cast<float>(n - 1), 0, 0};
    training.add({x, 1});
    std::size_t interval = 1;
    while ((n + interval - 1) / interval > 75) interval *= 2;
    const auto kept = training.frames();
    REQUIRE(training.n_added() == n);
    REQUIRE(kept.size() == (n + interval - 1) / interval);
    for (std::size_t i = 0; i < kept.size(); ++i) {
      REQUIRE(kept[i].size() == 3);
      REQUIRE(kept[i][0] == static_cast<float>(i * interval));
    }
  }
}

TEST_CASE("frames of any layout are kept packed") {
  const auto mesh = sheet<double>(4);
  const std::size_t k = mesh.size();
  std::vector<double> planar(3 * k);
  for (std::size_t i = 0; i < 3 * k; ++i) planar[i % 3 * k + i / 3] = mesh.vertices[i];
  Training<double> training(k);
  training.add({planar.data(), k, 1, static_cast<std::ptrdiff_t>(k)});
  CHECK(training.frames()[0] == mesh.vertices);
}

TEST_CASE("a frame that is refused changes nothing") {
  const auto shown = training_frames_of(sheet<float>(3).vertices, 4);
  Training<float> training(9);
  for (const auto& frame : shown) training.add({frame.data(), 9});
  for (const float bad : {std::numeric_limits<float>::quiet_NaN(), 1e30F}) {
    auto frame = shown[0];
    frame[13] = bad;
    CHECK_THROWS_AS(training.add({frame.data(), 9}), std::invalid_argument);
  }
  CHECK_THROWS_AS(training.add({shown[0].data(), 8}), std::invalid_argument);
  CHECK(training.n_added() == 4);
  CHECK(std::ranges::equal(training.frames(), shown));
}

SurfaceParts parts_of(const Mesh<double>& mesh, Index local_parts) {
  const Topology topology = build_topology(mesh.faces(), mesh.size());
  return divide_surface(topology.cells, rows_of(mesh.vertices), local_parts);
}

TEST_CASE("what no seed reaches has the global part alone") {
  auto mesh = join(sheet<double>(8), sheet<double>(3, 100));
  // A single seed has no second nearest one, so there is no typical distance.
  CHECK(parts_of(mesh, 1).n_parts == 1);
  mesh = join(sheet<double>(12), sheet<double>(2, 5));  // both seeds on the first sheet
  const SurfaceParts parts = parts_of(mesh, 2);
  CHECK(parts.n_parts == 3);
  REQUIRE(parts.offsets.size() == mesh.size() + 1);
  for (std::size_t v = 0; v < mesh.size(); ++v) {
    CHECK((parts.offsets[v + 1] - parts.offsets[v] > 1) == (v < 144));
  }
}

}  // namespace
}  // namespace dynmesh::testing
