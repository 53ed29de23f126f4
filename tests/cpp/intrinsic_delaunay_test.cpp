#include "detail/intrinsic_delaunay.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <map>
#include <numeric>

#include "meshes.hpp"

namespace dynmesh::testing {
namespace {

struct Surface {
  std::vector<Triangle> faces;
  std::vector<Vector3<double>> frame;
};

Surface surface_of(const Mesh<double>& mesh) {
  Surface surface;
  for (std::size_t f = 0; f < mesh.faces().count; ++f) surface.faces.push_back(mesh.faces()[f]);
  for (std::size_t i = 0; i < mesh.vertices.size(); i += 3) {
    surface.frame.push_back({mesh.vertices[i], mesh.vertices[i + 1], mesh.vertices[i + 2]});
  }
  return surface;
}

double area_of(const std::vector<IntrinsicTriangle>& triangles) {
  return std::accumulate(triangles.begin(), triangles.end(), 0.0,
                         [](double sum, const auto& t) { return sum + t.area(); });
}

/// The sum of the two cotangents opposite to each edge, identified by its ends and length.
std::map<std::tuple<Index, Index, long>, std::vector<double>> cotangents_of(
    const std::vector<IntrinsicTriangle>& triangles) {
  std::map<std::tuple<Index, Index, long>, std::vector<double>> found;
  for (const auto& t : triangles) {
    for (std::size_t s = 0; s < 3; ++s) {
      const Index a = t.vertices[s];
      const Index b = t.vertices[(s + 1) % 3];
      found[{std::min(a, b), std::max(a, b), std::lround(1e7 * t.lengths[s])}].push_back(
          t.cotangent(s));
    }
  }
  return found;
}

TEST_CASE("flips preserve the surface and satisfy the Delaunay condition") {
  auto mesh = sheet<double>(12);
  for (std::size_t i = 0; i < mesh.vertices.size(); i += 3) {
    mesh.vertices[i] += 3.1 * mesh.vertices[i + 1];  // far from Delaunay
    mesh.vertices[i + 2] = 0;
  }
  const Surface surface = surface_of(mesh);
  const auto triangles = intrinsic_delaunay(surface.faces, surface.frame, 1);
  CHECK(triangles.size() == surface.faces.size());
  CHECK(area_of(triangles) == doctest::Approx(121));  // a shear preserves the area
  std::size_t interior = 0;
  for (const auto& [edge, cotangents] : cotangents_of(triangles)) {
    REQUIRE(cotangents.size() <= 2);
    if (cotangents.size() == 2) CHECK(cotangents[0] + cotangents[1] >= -1e-9);
    interior += cotangents.size() - 1;
  }
  CHECK(interior == 341);  // (3 * 242 - 44) / 2
}

TEST_CASE("a flat Delaunay triangulation is not changed") {
  const Surface surface = surface_of(sheet<double>(6));
  const auto triangles = intrinsic_delaunay(surface.faces, surface.frame, 1);
  const auto again = intrinsic_delaunay(surface.faces, surface.frame, 2);
  for (std::size_t t = 0; t < triangles.size(); ++t) {
    CHECK(triangles[t].vertices == again[t].vertices);
    CHECK(triangles[t].lengths[0] == doctest::Approx(2 * again[t].lengths[0]));
  }
}

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
