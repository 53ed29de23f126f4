#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <random>

#include "meshes.hpp"
#include "stream/disconnected.hpp"

namespace dynmesh::testing {
namespace {

/// The squared distances to the nearest vertices of other components.
std::vector<double> plain_distances(const std::vector<Vector3<double>>& frame,
                                    const std::vector<Index>& component) {
  std::vector<double> distances;
  for (std::size_t v = 0; v < frame.size(); ++v) {
    double nearest = std::numeric_limits<double>::infinity();
    for (std::size_t n = 0; n < frame.size(); ++n) {
      const double distance = squared_norm(frame[v] - frame[n]);
      if (component[v] != component[n]) nearest = std::min(nearest, distance);
    }
    distances.push_back(nearest);
  }
  return distances;
}

TEST_CASE("donors are the nearest vertices of other components") {
  for (unsigned seed = 0; seed < 40; ++seed) {
    std::mt19937 random(seed);
    std::uniform_int_distribution<Index> label(0, static_cast<Index>(seed % 7));
    std::uniform_int_distribution<int> coordinate(0,
                                                  seed % 2 == 0 ? 3 : 1000);  // many ties, or few
    std::vector<Vector3<double>> frame(300);
    std::vector<Index> component(frame.size());
    for (std::size_t v = 0; v < frame.size(); ++v) {
      frame[v] = {static_cast<double>(coordinate(random)), static_cast<double>(coordinate(random)),
                  static_cast<double>(coordinate(random))};
      component[v] = label(random);
    }
    const auto donors = find_donors<double>(frame, component);
    const auto distances = plain_distances(frame, component);
    for (std::size_t v = 0; v < frame.size(); ++v) {
      REQUIRE((donors[v] < 0) == std::isinf(distances[v]));
      if (donors[v] < 0) continue;
      const auto donor = static_cast<std::size_t>(donors[v]);
      CHECK(component[donor] != component[v]);
      CHECK(squared_norm(frame[v] - frame[donor]) == distances[v]);
    }
  }
}

TEST_CASE("coincident isolated vertices do not slow down the search") {
  const std::vector<Vector3<float>> frame(200'000, Vector3<float>{1, 2, 3});
  std::vector<Index> component(frame.size());
  for (std::size_t v = 0; v < frame.size(); ++v) component[v] = static_cast<Index>(v);
  const auto donors = find_donors<float>(frame, component);
  for (const Index v : {0, 5, 199'999}) CHECK((donors[v] >= 0 && donors[v] != v));
}

}  // namespace
}  // namespace dynmesh::testing
