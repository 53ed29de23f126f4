/// Method detail that learns from the frames that it completes.
#include <doctest/doctest.h>

#include <deque>
#include <limits>
#include <utility>
#include <vector>

#include "detail/learned_modes.hpp"
#include "support/workers.hpp"

namespace dynmesh::testing {
namespace {

/// A library of shapes of one coordinate at the second of two vertices.
struct Heights {
  static SurfaceParts parts() {
    SurfaceParts parts;
    parts.offsets = {0, 1, 2};
    parts.entries = {{0, 1.0}, {0, 1.0}};
    return parts;
  }

  bool offer(double height) {
    std::vector<ShapeTerms> memory(2);
    memory[1].to_rest.y = -height;
    return library.offer(memory);
  }
  [[nodiscard]] double in_slot(Index slot) const {
    return static_cast<double>(
        library.rows()[1][static_cast<std::size_t>(most_learned_shapes + slot)]);
  }

  Workers workers = Workers(1);
  ShapeLibrary library = ShapeLibrary(parts(), workers, 1);
};

TEST_CASE("a shape keeps its slot for eight frames after it has left the library") {
  Heights heights;
  // The slots and heights of the members after each of the last frames.
  std::deque<std::vector<std::pair<Index, double>>> last;
  for (int n = 1; n <= 400; ++n) {
    heights.offer((n * n) % 97 + 0.25 * (n % 5));
    for (const auto& members : last) {
      for (const auto& [slot, height] : members) REQUIRE(heights.in_slot(slot) == height);
    }
    auto& members = last.emplace_back();
    for (const Index slot : heights.library.members()) {
      members.emplace_back(slot, heights.in_slot(slot));
    }
    if (last.size() > 8) last.pop_front();
  }
}

TEST_CASE("a shape out of any range does not enter") {
  SurfaceParts parts;
  parts.offsets = {0, 1};
  parts.entries = {{0, 1.0}};
  Workers workers(1);
  ShapeLibrary library(parts, workers, 1);
  std::vector<ShapeTerms> memory(1);
  for (const double bad : {1e7, -1e300, std::numeric_limits<double>::infinity(),
                           std::numeric_limits<double>::quiet_NaN()}) {
    memory[0].to_rest.z = bad;
    CHECK_FALSE(library.offer(memory));
    CHECK_FALSE(library.offer(memory));
    CHECK(library.members().empty());
    CHECK(library.rows()[0] == ShapeLibrary::Row{});
  }
  // The range is that of the mesh, whatever its unit.
  for (const double mean_edge : {1e-12, 1e12}) {
    ShapeLibrary other(parts, workers, mean_edge);
    memory[0].to_rest.z = 1e7 * mean_edge;
    other.offer(memory);
    CHECK_FALSE(other.offer(memory));
    memory[0].to_rest.z = 1e5 * mean_edge;
    other.offer(memory);
    CHECK(other.offer(memory));
  }
}

}  // namespace
}  // namespace dynmesh::testing
