#include "mesh/numbering.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <dynmesh/completer.hpp>
#include <numeric>
#include <random>

#include "meshes.hpp"
#include "shared_work.hpp"

namespace dynmesh::testing {
namespace {

constexpr std::size_t numbered_side = 174;  // large enough that the numbering matters

/// A random permutation of the vertices of a sheet.
std::vector<Index> shuffled_numbers() {
  std::vector<Index> number(numbered_side * numbered_side);
  std::iota(number.begin(), number.end(), 0);
  std::shuffle(number.begin(), number.end(), std::mt19937(4));
  return number;
}

/// The sheet with its vertices in that order.
struct Renumbered {
  std::vector<Index> number;
  std::vector<Index> indices;
  std::vector<float> vertices;

  Renumbered(const Mesh<float>& mesh, std::vector<Index> numbers) : number(std::move(numbers)) {
    for (const Index v : mesh.indices) indices.push_back(number[static_cast<std::size_t>(v)]);
    vertices = placed(mesh.vertices);
  }
  [[nodiscard]] std::vector<float> placed(const std::vector<float>& rows) const {
    std::vector<float> result(rows.size());
    for (std::size_t v = 0; v < number.size(); ++v) {
      const auto to = static_cast<std::size_t>(number[v]);
      for (std::size_t c = 0; c < 3; ++c) result[3 * to + c] = rows[3 * v + c];
    }
    return result;
  }
};

Points<const float> view(const std::vector<float>& rows) { return {rows.data(), rows.size() / 3}; }

TEST_CASE("only large meshes with scattered neighbours are reordered") {
  const auto mesh = sheet<float>(numbered_side);
  CHECK(choose_numbering(build_topology(mesh.faces(), mesh.size()).cells).is_natural());
  const Renumbered shuffled(mesh, shuffled_numbers());
  const Topology topology = build_topology(faces_of(shuffled.indices), mesh.size());
  const Numbering numbering = choose_numbering(topology.cells);
  REQUIRE(!numbering.is_natural());
  const Topology renumbered = renumber(topology, numbering);
  for (std::size_t internal = 0; internal < mesh.size(); ++internal) {
    const auto vertex = numbering.caller_indices[internal];
    REQUIRE(numbering.internal_index(static_cast<std::size_t>(vertex)) == internal);
    const auto cell = topology.cells[vertex];
    const auto found = renumbered.cells[static_cast<Index>(internal)];
    REQUIRE(std::ranges::equal(cell, found, {}, {}, [&](Index p) {
      return numbering.caller_indices[static_cast<std::size_t>(p)];
    }));
  }
  CHECK(choose_numbering(renumbered.cells).is_natural());
}

TEST_CASE("results do not depend on the order of vertices and the number of threads") {
  const SharedWork shared(512);
  const auto mesh = sheet<float>(numbered_side);
  const std::size_t k = mesh.size();
  const Renumbered shuffled(mesh, shuffled_numbers());
  Completer<float> natural(mesh.faces(), view(mesh.vertices));
  std::vector<Completer<float>> others;
  for (const Index threads : {1, 3}) {
    others.emplace_back(faces_of(shuffled.indices), view(shuffled.vertices),
                        Settings{.threads = threads});
  }

  std::mt19937 random(1);
  std::normal_distribution<float> step(0, 0.01F);
  std::vector<float> expected(3 * k);
  for (int frame = 0; frame < 3; ++frame) {
    std::vector<float> points = mesh.vertices;
    // Stretched, so that no edges are kept: which anchors are left out to find out whether they are
    // depends on the order.
    for (float& x : points) x += 0.2F * static_cast<float>(frame + 1) * x + step(random);
    const auto known = random_mask(k, 0.3, static_cast<unsigned>(frame));
    std::vector<std::uint8_t> known_shuffled(k);
    for (std::size_t v = 0; v < k; ++v) {
      known_shuffled[static_cast<std::size_t>(shuffled.number[v])] = known[v];
      if (known[v] == 0) points[3 * v] = NAN;
    }
    const std::vector<float> given = shuffled.placed(points);
    std::vector<Index> indices;
    std::vector<float> sparse;
    for (std::size_t v = 0; v < k; ++v) {
      if (known_shuffled[v] == 0) continue;
      indices.push_back(static_cast<Index>(v));
      sparse.insert(sparse.end(), &given[3 * v], &given[3 * v] + 3);
    }
    natural.push(view(points), {known.data(), k}, {expected.data(), k});
    const auto wanted = shuffled.placed(expected);

    std::vector<std::vector<float>> found(others.size(), std::vector<float>(3 * k));
    for (std::size_t i = 0; i < others.size(); ++i) {
      auto& other = others[i];
      const Points<float> out(found[i].data(), k);
      const auto pieces = shared_pieces([&] {
        if (frame % 3 == 0) other.push(view(given), {known_shuffled.data(), k}, out);
        if (frame % 3 == 1) other.push(view(given), out);
        if (frame % 3 == 2) other.push_sparse(indices, view(sparse), out);
      });
      CHECK((pieces > 0) == (other.settings().threads > 1));
      CHECK(found[i] == found[0]);  // to the last bit
      CHECK(testing::largest_difference(found[i], wanted) < 1e-4);
      bool same = true;
      for (std::size_t v = 0; v < k; ++v) {
        const auto at = static_cast<std::size_t>(shuffled.number[v]);
        same = same && other.generation()[at] == natural.generation()[v] &&
               other.age()[at] == natural.age()[v];
      }
      CHECK(same);
      CHECK(other.report().iterations == natural.report().iterations);
    }
  }
  others[1].restore(others[0].state());
  CHECK(others[1].state() == others[0].state());

  auto points = shuffled.vertices;
  points[3 * 77 + 1] = NAN;
  const std::vector<std::uint8_t> all(k, 1);
  CHECK_THROWS_WITH_AS(others[0].push(view(points), {all.data(), k}, {points.data(), k}),
                       doctest::Contains("points: row 77 is at"), std::invalid_argument);
}

}  // namespace
}  // namespace dynmesh::testing
