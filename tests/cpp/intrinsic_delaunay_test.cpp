#include "detail/intrinsic_delaunay.hpp"

#include <doctest/doctest.h>

#include <cmath>
#include <vector>

namespace dynmesh::testing {
namespace {

TEST_CASE("degenerate triangles and non-manifold edges are handled") {
  const std::vector<Vector3<double>> frame = {{0, 0, 0}, {1, 0, 0},   {1, 0, 0},      {2, 0, 0},
                                              {0, 1, 0}, {0.5, 9, 0}, {0.5, -1e-9, 0}};
  const std::vector<Triangle> faces = {{0, 1, 2}, {0, 1, 3}, {0, 1, 4}, {1, 0, 5}, {0, 1, 6},
                                       {3, 3, 4}, {0, 1, 4}, {1, 0, 4}, {4, 3, 5}, {5, 3, 4}};
  const auto triangles = intrinsic_delaunay(faces, frame, 1);
  CHECK(triangles.size() == 9);
  for (const auto& t : triangles) {
    CHECK(t.area() > 0);
    for (std::size_t s = 0; s < 3; ++s) CHECK(std::abs(t.cotangent(s)) < 1e6);
  }
}

}  // namespace
}  // namespace dynmesh::testing
