/// Tests method detail with few known vertices and with degenerate meshes.
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <dynmesh/completer.hpp>
#include <limits>
#include <vector>

#include "meshes.hpp"
#include "push.hpp"
#include "training_data.hpp"

namespace dynmesh::testing {
namespace {

constexpr Settings detail = {.method = Method::detail};

TEST_CASE("a single anchor moves the whole shape") {
  const auto mesh = sheet<double>(10);
  Completer<double> completer(mesh.faces(), mesh.points(), detail);
  const auto frame = translated<double>(mesh.vertices, 2, 3, -1);
  CHECK(largest_difference(push(completer, frame, mask(mesh.size(), {37})), frame) < 1e-5);
}

TEST_CASE("degenerate meshes stay finite") {
  auto mesh = sheet<double>(9);
  SUBCASE("coincident vertices") {
    for (const std::size_t v : {40, 41, 50}) {
      std::copy_n(mesh.vertices.begin() + 93, 3, mesh.vertices.begin() + 3 * static_cast<int>(v));
    }
  }
  SUBCASE("needles") {
    for (std::size_t i = 0; i < mesh.vertices.size(); i += 3) mesh.vertices[i + 1] *= 1e-9;
  }
  SUBCASE("all vertices on one line") {
    for (std::size_t i = 0; i < mesh.vertices.size(); i += 3) {
      mesh.vertices[i + 1] = mesh.vertices[i + 2] = 0;
    }
  }
  SUBCASE("all vertices coincide") { std::ranges::fill(mesh.vertices, 2.5); }
  SUBCASE("single triangles and isolated vertices") {
    for (std::size_t i = 0; i < mesh.indices.size(); ++i) {
      mesh.indices[i] = static_cast<Index>(i % 75);
    }
  }
  SUBCASE("faces with repeated vertices, and edges of many faces") {
    for (std::size_t i = 0; i < mesh.indices.size(); i += 3) {
      if (i % 4 == 0) mesh.indices[i] = mesh.indices[i + 1];
      if (i % 5 == 0) mesh.indices[i] = 7;
      if (i % 5 == 0) mesh.indices[i + 1] = 8;
    }
  }
  Completer<double> completer(mesh.faces(), mesh.points(), detail);
  for (unsigned n = 1; n <= 8; ++n) {
    const auto frame = translated<double>(turned(mesh.vertices, 0.1 * n), 0.1 * n, 0, 0);
    const auto completed = push(completer, frame, random_mask(mesh.size(), 0.1 * n, n));
    CHECK(largest(completed) < 100);
  }
}

TEST_CASE("a distant anchor does not affect later frames") {
  const auto mesh = sheet<double>(9);
  Completer<double> completer(mesh.faces(), mesh.points(), detail);
  auto outlier = mesh.vertices;
  outlier[120] = 1e200;
  push(completer, outlier, random_mask(mesh.size(), 0.5, 1));
  auto known = random_mask(mesh.size(), 0.5, 2);
  known[40] = 1;
  CHECK(largest(push(completer, outlier, known)) <= 1e200);
  push(completer, mesh.vertices, std::vector<std::uint8_t>(mesh.size(), 1));
  const auto completed = push(completer, mesh.vertices, random_mask(mesh.size(), 0.5, 3));
  CHECK(largest_difference(completed, mesh.vertices) < 1e-6);
}

TEST_CASE("the result does not depend on the scale") {
  const auto mesh = sheet<double>(9);
  const auto complete = [&](double scale) {
    auto vertices = mesh.vertices;
    for (double& x : vertices) x *= scale;
    Completer<double> completer(mesh.faces(), {vertices.data(), mesh.size()}, detail);
    std::vector<double> completed;
    for (unsigned n = 1; n <= 4; ++n) {
      auto frame = turned(mesh.vertices, 0.2 * n);
      for (std::size_t i = 2; i < frame.size(); i += 3) frame[i] *= 1 + 0.2 * n;
      for (double& x : frame) x *= scale;
      completed = push(completer, frame, random_mask(mesh.size(), 0.3, n));
    }
    for (double& x : completed) x /= scale;
    return completed;
  };
  const auto expected = complete(1);
  for (const double scale : {1e-4, 1e6, 1e-60, 1e60}) {
    CHECK(largest_difference(complete(scale), expected) < 1e-9);
  }
}

TEST_CASE("if no vertex is known, none moves") {
  const auto mesh = sheet<double>(9);
  const std::vector<std::uint8_t> none(mesh.size(), 0);
  Completer<double> completer(mesh.faces(), mesh.points(), detail);
  CHECK(push(completer, mesh.vertices, none) == mesh.vertices);
  const auto last = push(completer, turned(mesh.vertices, 0.2), random_mask(mesh.size(), 0.3, 1));
  for (int n = 0; n < 3; ++n) CHECK(push(completer, mesh.vertices, none) == last);
}

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

TEST_CASE_TEMPLATE("extreme lengths and outliers do no harm to what is learned", Real, float,
                   double) {
  bool is_trained = false;
  SUBCASE("by training") { is_trained = true; }
  SUBCASE("from the frames") {}
  const Settings settings = {.method = Method::detail, .learn = !is_trained};
  auto mesh = join(sheet<Real>(5), sheet<Real>(2, 20));
  mesh.vertices.insert(mesh.vertices.end(), {9, 9, 9});
  const std::size_t k = mesh.size();
  const int exponent = std::numeric_limits<Real>::max_exponent / 3;
  for (const int scale : {0, -exponent, exponent}) {
    CAPTURE(scale);
    const auto scaled = [scale](std::vector<Real> values) {
      for (Real& x : values) x = std::ldexp(x, scale);
      return values;
    };
    const Mesh<Real> first = {scaled(mesh.vertices), mesh.indices};
    auto shown = training_frames_of(mesh.vertices, 5);
    for (auto& frame : shown) frame = scaled(frame);
    const auto make = [&] {
      return is_trained
                 ? Completer<Real>(first.faces(), first.points(), settings, training_of(shown))
                 : Completer<Real>(first.faces(), first.points(), settings);
    };
    auto completer = make();
    auto other = make();
    for (unsigned n = 0; n < 80; ++n) {
      auto frame = bent(mesh.vertices, n);
      if (n % 9 == 8) frame[3] *= 10000;
      const auto known = n % 13 == 11 ? mask(k, {0}) : random_mask(k, 0.1 * (n % 6), n);
      CHECK(std::isfinite(largest(push(completer, scaled(frame), known))));
      other.restore(completer.state());
      CHECK(other.state() == completer.state());
    }
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
