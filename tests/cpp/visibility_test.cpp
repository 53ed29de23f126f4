#include "registration/visibility.hpp"

#include <doctest/doctest.h>

#include <array>
#include <vector>

namespace dynmesh::testing {
namespace {

using Vector = Vector3<double>;

/// Squares of n by n vertices, one edge apart, around the origin of the x and y axes.
struct Squares {
  std::vector<Vector> vertices;
  std::vector<Vector> normals;
  std::vector<Triangle> faces;

  void add(int n, double z, double facing) {
    const auto first = static_cast<Index>(vertices.size());
    for (int i = 0; i < n; ++i) {
      for (int j = 0; j < n; ++j) {
        vertices.push_back({j - 0.5 * (n - 1), i - 0.5 * (n - 1), z});
        normals.push_back({0, 0, facing});
      }
    }
    for (Index i = 0; i + 1 < n; ++i) {
      for (Index j = 0; j + 1 < n; ++j) {
        const Index v = first + i * n + j;
        faces.push_back({v, v + 1, v + n});
        faces.push_back({v + 1, v + n + 1, v + n});
      }
    }
  }

  [[nodiscard]] std::vector<Sight> seen_from(const std::vector<Vector>& viewpoints,
                                             bool are_sheets) const {
    const std::vector<std::uint8_t> is_sheet(vertices.size(), are_sheets ? 1 : 0);
    std::vector<Sight> seen(vertices.size());
    Visibility visibility(vertices.size());
    visibility.find(faces, vertices, normals, viewpoints, is_sheet, {1, 1.5, 0.5}, seen);
    return seen;
  }
};

std::vector<Sight> all(std::size_t n, Sight sight) { return std::vector<Sight>(n, sight); }

TEST_CASE("what lies behind something else is hidden, also from close by") {
  Squares squares;
  squares.add(11, 2, 1);
  squares.add(5, -2, 1);  // half the sphere around both is 7.35
  for (const double distance : {8.0, 20.0, 400.0}) {
    auto expected = all(121, Sight::front);
    expected.resize(146, Sight::hidden);
    CHECK(squares.seen_from({{0, 0, distance}}, false) == expected);
  }
  CHECK(squares.seen_from({}, false) == all(146, Sight::front));
}

TEST_CASE("a surface around the viewpoint hides nothing from it") {
  Squares squares;
  squares.add(11, 2, -1);
  squares.add(5, 4, -1);
  squares.add(11, -4, 1);
  CHECK(squares.seen_from({{0, 0, 0}}, true) == all(267, Sight::front));
}

TEST_CASE("the back of a sheet is seen from behind, and not from the side") {
  Squares sheet;
  sheet.add(11, 0, 1);
  CHECK(sheet.seen_from({{0, 0, 20}}, true) == all(121, Sight::front));
  CHECK(sheet.seen_from({{0, 0, -20}}, true) == all(121, Sight::back));
  CHECK(sheet.seen_from({{0, 0, -20}}, false) == all(121, Sight::hidden));
  for (const double side : {20.0, -20.0}) {
    CHECK(sheet.seen_from({{0, 0, side}, {0, 0, -side}}, true) == all(121, Sight::both));
    CHECK(sheet.seen_from({{0, 0, side}, {0, 0, -side}}, false) == all(121, Sight::front));
  }
  // Nothing is drawn of a sheet that is seen from its edge.
  CHECK(sheet.seen_from({{20, 1, 0}}, true) == all(121, Sight::hidden));
}

}  // namespace
}  // namespace dynmesh::testing
