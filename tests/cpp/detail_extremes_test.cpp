/// Tests method detail with few known vertices and with degenerate meshes.
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <dynmesh/completer.hpp>
#include <vector>

#include "meshes.hpp"
#include "push.hpp"

namespace dynmesh::testing {
namespace {

constexpr Settings detail = {.method = Method::detail};

TEST_CASE("a rotation is completed on every kind of mesh, more accurately than by motion") {
  auto mesh = sheet<double>(12);
  std::size_t first_disconnected = mesh.size();
  SUBCASE("open") {}
  SUBCASE("closed") {
    mesh = torus(12);
    first_disconnected = mesh.size();
  }
  SUBCASE("two coincident vertices") {
    std::copy_n(mesh.vertices.begin() + 120, 3, mesh.vertices.begin() + 123);
  }
  SUBCASE("needles") {
    for (std::size_t i = 0; i < mesh.vertices.size(); i += 3) mesh.vertices[i + 1] *= 1e-9;
  }
  SUBCASE("a row of needles") {
    for (std::size_t v = 60; v < 72; ++v) mesh.vertices[3 * v + 1] = 4 + 1e-7;
  }
  SUBCASE("single triangles") {
    mesh = taken_apart(mesh);
    first_disconnected = mesh.size();
  }
  SUBCASE("one component disconnected") { mesh = join(mesh, sheet<double>(4, 14)); }
  const auto error = [&](Method method, double scale) {
    auto first = mesh.vertices;
    for (double& x : first) x *= scale;
    Completer<double> completer(mesh.faces(), {first.data(), mesh.size()}, {.method = method});
    double sum = 0;
    for (unsigned n = 1; n <= 8; ++n) {
      auto frame = translated<double>(turned(mesh.vertices, 0.1 * n), 0.3 * n, -0.2 * n, 0.1 * n);
      for (double& x : frame) x *= scale;
      auto known = random_mask(mesh.size(), 0.3, n);
      const auto disconnected = static_cast<std::ptrdiff_t>(first_disconnected);
      std::fill(known.begin() + disconnected, known.end(), std::uint8_t{0});
      const auto completed = push(completer, frame, known);
      for (std::size_t i = 0; i < frame.size(); ++i) sum += std::abs(completed[i] - frame[i]);
    }
    return sum / scale;
  };
  const double expected = error(Method::detail, 1);
  CHECK(expected < 0.75 * error(Method::motion, 1));
  for (const double scale : {1e-4, 1e6}) {
    CHECK(error(Method::detail, scale) == doctest::Approx(expected).epsilon(1e-3));
  }
}

TEST_CASE("the blend does not depend on rounding errors if the anchors do not determine it") {
  const auto mesh = taken_apart(sheet<double>(12));
  const auto complete = [&](double scale) {
    auto vertices = mesh.vertices;
    for (double& x : vertices) x *= scale;
    Completer<double> completer(mesh.faces(), {vertices.data(), mesh.size()}, detail);
    std::vector<double> completed;
    for (unsigned n = 1; n <= 60; ++n) {
      auto frame = turned(mesh.vertices, 0.1 * n);
      for (double& x : frame) x *= scale;
      completed = push(completer, frame, random_mask(mesh.size(), n < 4 ? 0.5 : 0.02, n));
    }
    for (double& x : completed) x /= scale;
    return completed;
  };
  const auto expected = complete(1);
  CHECK(largest(expected) < 40);
  for (const double scale : {1e-4, 1e6}) {
    CHECK(largest_difference(complete(scale), expected) < 1e-6);
  }
}

TEST_CASE("a vertex with too many neighbours is refused by detail and accepted by motion") {
  constexpr Index rim = 9000;
  std::vector<double> vertices(3 * (rim + 1));
  std::vector<Index> faces;
  for (Index v = 1; v <= rim; ++v) {
    vertices[3 * static_cast<std::size_t>(v)] = std::cos(v * 6.28 / rim);
    vertices[3 * static_cast<std::size_t>(v) + 1] = std::sin(v * 6.28 / rim);
    if (v < rim) faces.insert(faces.end(), {0, v, v + 1});
  }
  const Points<const double> frame(vertices.data(), rim + 1);
  CHECK(message_of([&] { Completer<double>(faces_of(faces), frame, detail); }) ==
        "faces: vertex 0 has 9000 neighbours, too many for method detail");
  CHECK_NOTHROW(Completer<double>(faces_of(faces), frame, {.method = Method::motion}));
}

}  // namespace
}  // namespace dynmesh::testing
