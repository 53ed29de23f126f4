#include <doctest/doctest.h>

#include <limits>
#include <random>

#include "disconnected/disconnected.hpp"
#include "meshes.hpp"

namespace dynmesh::testing {
namespace {

template <class Real>
std::vector<Index> plain_donors(const std::vector<Vector3<Real>>& frame,
                                const std::vector<Index>& component) {
  std::vector<Index> donors(frame.size(), -1);
  for (std::size_t v = 0; v < frame.size(); ++v) {
    double nearest = std::numeric_limits<double>::infinity();
    for (std::size_t n = 0; n < frame.size(); ++n) {
      const double distance = squared_norm(frame[v] - frame[n]);
      if (component[v] != component[n] && distance < nearest) {
        nearest = distance;
        donors[v] = static_cast<Index>(n);
      }
    }
  }
  return donors;
}

TEST_CASE("donors are the nearest vertices of other components, with the smallest index") {
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
    CHECK(find_donors<double>(frame, component) == plain_donors(frame, component));
  }
}

TEST_CASE("coincident isolated vertices do not slow down the search") {
  const std::vector<Vector3<float>> frame(200'000, Vector3<float>{1, 2, 3});
  std::vector<Index> component(frame.size());
  for (std::size_t v = 0; v < frame.size(); ++v) component[v] = static_cast<Index>(v);
  const auto donors = find_donors<float>(frame, component);
  CHECK(donors[0] == 1);
  CHECK(donors[5] == 0);
}

}  // namespace
}  // namespace dynmesh::testing
