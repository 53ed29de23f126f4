/// Frames that are put together of all frames: which ones are read, and with what they begin.
#include <doctest/doctest.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <dynmesh/whole_frame.hpp>
#include <span>
#include <vector>

#include "meshes.hpp"
#include "whole_frame/trips.hpp"

namespace dynmesh::testing {
namespace {

TEST_CASE("frames of a whole one are read in order, twice, and only those that are used") {
  const Mesh<double> mesh = sheet<double>(3);
  std::vector<std::size_t> read;
  const FrameSource<double> source = [&](std::size_t t, Points<double> points,
                                         std::span<std::uint8_t> known) {
    read.push_back(t);
    std::ranges::copy(mesh.vertices, points.data);
    std::ranges::fill(known, std::uint8_t{1});
  };
  const std::size_t n = 2000;
  const auto whole = whole_frame(mesh.faces(), mesh.size(), n, source);
  CHECK(whole.positions == mesh.vertices);
  CHECK(whole.frame == n / 2 - 1);  // the one nearest to the middle
  const auto second = read.begin() + static_cast<std::ptrdiff_t>(n);
  CHECK(std::is_sorted(read.begin(), second));
  CHECK(std::is_sorted(second, read.end()));
  CHECK(read.end() - second < 300);
  for (std::size_t t = whole.frame - 30; t <= whole.frame + 30; ++t) {
    CHECK(std::find(second, read.end(), t) != read.end());
  }
  CHECK(*second < 50);
  CHECK(read.back() > n - 50);
}

TEST_CASE("a component begins with what another frame knows if the base knows fewer than four") {
  const auto mesh = join(sheet<double>(4), sheet<double>(3, 9.0));
  const std::size_t k = mesh.size();
  const Topology topology = build_topology(mesh.faces(), k);
  for (const std::size_t n_known : {3, 4}) {
    std::vector<std::uint8_t> known(k, 1);
    std::fill(known.begin() + static_cast<std::ptrdiff_t>(16 + n_known), known.end(), 0);
    Window<double> window;
    window.n_vertices = k;
    window.numbers = {0, 1};
    window.positions = {mesh.vertices, turned(mesh.vertices, 0.5)};
    window.known = {known, std::vector<std::uint8_t>(k, 1)};
    const PartialFrame frame = known_parts(topology, window);
    CHECK(std::ranges::count(frame.fixed, 1) == (n_known == 3 ? 25 : 20));
    const auto expected = rows_of(mesh.vertices);
    for (std::size_t v = 0; v < k; ++v) {
      if (frame.fixed[v] != 0) CHECK(squared_norm(frame.positions[v] - expected[v]) < 1e-20);
    }
  }
}

}  // namespace
}  // namespace dynmesh::testing
