#include "tracking/surface_places.hpp"

#include <doctest/doctest.h>

#include <vector>

#include "meshes.hpp"
#include "support/workers.hpp"

namespace dynmesh::testing {
namespace {

TEST_CASE("the nearest place is that of all triangles, also after the surface has moved") {
  const auto mesh = torus(12);
  const auto faces = triangles_of(mesh);
  const auto first = rows_of(mesh.vertices);
  SurfacePlaces places(faces, first);
  auto x = first;
  for (auto& position : x) position = {position.y, 2 * position.z, -position.x};
  places.follow(x);
  const auto anywhere = [](const Place&) { return true; };
  const auto upwards = [](const Place& place) { return place.face % 2 == 0; };
  for (const auto& point : random_field(200, 5)) {
    Place nearest, nearest_upwards;
    for (std::uint32_t f = 0; f < faces.size(); ++f) {
      const Place place = places.place_on(x, f, point);
      const auto on = place.on(x);
      CHECK(place.squared == doctest::Approx(squared_norm(on - point)));
      for (const auto corner : place.corners) {
        // No corner, nor the middle between it and the place, is nearer.
        CHECK(place.squared <= squared_norm(x[corner] - point) + 1e-12);
        CHECK(place.squared <= squared_norm(0.5 * (on + x[corner]) - point) + 1e-12);
      }
      if (place.squared < nearest.squared) nearest = place;
      if (upwards(place) && place.squared < nearest_upwards.squared) nearest_upwards = place;
    }
    CHECK(places.nearest(x, point, {}, anywhere).squared == nearest.squared);
    CHECK(places.nearest(x, point, {}, upwards).squared == nearest_upwards.squared);
    CHECK(places.nearest(x, point, places.place_on(x, 7, point), anywhere).squared ==
          nearest.squared);
    const Place bound = {.squared = 0.5 * nearest.squared};
    CHECK(places.nearest(x, point, bound, anywhere).squared == bound.squared);
  }
}

TEST_CASE("a walk over a flat surface ends at the nearest place of all") {
  const auto mesh = sheet<double>(12);
  const auto faces = triangles_of(mesh);
  auto x = rows_of(mesh.vertices);
  for (auto& position : x) position.z = 0;
  SurfacePlaces places(faces, x);
  places.follow(x);
  for (const auto& point : random_field(200, 6)) {
    const auto far = 10.0 * point;  // beside it, too
    const Place nearest = places.nearest(x, far, {}, [](const Place&) { return true; });
    CHECK(places.walk(x, far, 11).squared == doctest::Approx(nearest.squared));
  }
}

TEST_CASE("a place on a triangle without area is on one of its sides") {
  const std::vector<Triangle> faces = {{0, 1, 2}, {3, 3, 3}};
  const std::vector<Vector3<double>> x = {{0, 0, 0}, {2, 0, 0}, {1, 0, 0}, {5, 0, 0}};
  SurfacePlaces places(faces, x);
  places.follow(x);
  const auto anywhere = [](const Place&) { return true; };
  CHECK(places.nearest(x, {1.5, 2, 0}, {}, anywhere).squared == doctest::Approx(4));
  CHECK(places.nearest(x, {5, 0, 3}, {}, anywhere).squared == doctest::Approx(9));
}

}  // namespace
}  // namespace dynmesh::testing
