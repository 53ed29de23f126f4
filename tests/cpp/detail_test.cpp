#include "detail.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <dynmesh/completer.hpp>
#include <limits>

#include "meshes.hpp"

namespace dynmesh::testing {
namespace {

constexpr Settings detail = {.method = Method::detail};

template <class Real>
std::vector<Real> push(Completer<Real>& completer, const std::vector<Real>& frame,
                       const std::vector<std::uint8_t>& known) {
  std::vector<Real> completed(frame.size());
  const std::size_t k = known.size();
  completer.push({frame.data(), k}, {known.data(), k}, {completed.data(), k});
  return completed;
}

/// Largest coordinate; infinite where one is not finite.
template <class Real>
double largest(const std::vector<Real>& values) {
  double most = 0;
  for (const Real x : values) {
    if (!std::isfinite(x)) return std::numeric_limits<double>::infinity();
    most = std::max(most, std::abs(static_cast<double>(x)));
  }
  return most;
}

/// n by n vertices around a torus: closed.
Mesh<double> torus(int n) {
  Mesh<double> mesh;
  for (int i = 0; i < n; ++i) {
    for (int j = 0; j < n; ++j) {
      const double u = 2 * 3.14159265358979 * i / n;
      const double v = 2 * 3.14159265358979 * j / n;
      const double r = 3 + std::cos(v);
      mesh.vertices.insert(mesh.vertices.end(), {r * std::cos(u), r * std::sin(u), std::sin(v)});
      const Index a = i * n + j;
      const Index b = i * n + (j + 1) % n;
      const Index c = (i + 1) % n * n + j;
      const Index d = (i + 1) % n * n + (j + 1) % n;
      mesh.indices.insert(mesh.indices.end(), {a, c, b, b, c, d});
    }
  }
  return mesh;
}

TEST_CASE("a translation is completed exactly, and a turn nearly") {
  for (const Mesh<double>& mesh : {sheet<double>(12), torus(14)}) {
    const std::size_t k = mesh.size();
    Completer<double> moved(mesh.faces(), mesh.points(), detail);
    Completer<double> rotated(mesh.faces(), mesh.points(), detail);
    for (unsigned n = 1; n <= 5; ++n) {
      const auto translation = translated<double>(mesh.vertices, n, -1.0 * n, 0.5 * n);
      const auto few = random_mask(k, 0.1, n);
      CHECK(largest_difference(push(moved, translation, few), translation) < 1e-9);
      const auto turn = turned(mesh.vertices, 0.05 * n);
      CHECK(largest_difference(push(rotated, turn, random_mask(k, 0.5, n)), turn) < 0.02);
    }
    CHECK(rotated.report().iterations == 3);
  }
}

TEST_CASE_TEMPLATE("frames are finite and sensible whatever is known", Real, float, double) {
  const auto mesh = join(sheet<Real>(9), sheet<Real>(4, 20));
  const std::size_t k = mesh.size();
  for (const UnseenRule rule : {UnseenRule::follow, UnseenRule::hold}) {
    Completer<Real> completer(mesh.faces(), mesh.points(),
                              {.method = Method::detail, .unseen = rule});
    const std::vector<std::uint8_t> none(k, 0);
    const auto only = [&](const std::vector<std::size_t>& vertices) {
      auto known = none;
      for (const std::size_t v : vertices) known[v] = 1;
      return known;
    };
    auto only_first = random_mask(k, 0.3, 3);
    std::fill(only_first.begin() + 81, only_first.end(), std::uint8_t{0});
    const std::vector<std::vector<std::uint8_t>> masks = {
        none,       only({40}), only({40, 85}),         only_first,
        none,       only_first, random_mask(k, 0.5, 1), std::vector<std::uint8_t>(k, 1),
        only({90}), only_first};
    Real angle = 0;
    for (const auto& known : masks) {
      angle += Real(0.1);
      const auto frame = translated<Real>(turned(mesh.vertices, angle), angle, 0, 0);
      const auto completed = push(completer, frame, known);
      CHECK(largest(completed) < 50);
      for (std::size_t v = 0; v < k; ++v) {
        if (known[v] != 0) CHECK(completed[3 * v] == frame[3 * v]);
      }
    }
  }
}

TEST_CASE("one anchor carries the shape along") {
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
  SUBCASE("all on one line") {
    for (std::size_t i = 0; i < mesh.vertices.size(); i += 3) {
      mesh.vertices[i + 1] = mesh.vertices[i + 2] = 0;
    }
  }
  SUBCASE("all in one place") { std::ranges::fill(mesh.vertices, 2.5); }
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

TEST_CASE("an anchor far away harms no later frame") {
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

TEST_CASE("scale changes nothing") {
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

TEST_CASE("a completer continues from its state to the last bit") {
  const auto mesh = join(sheet<float>(9), sheet<float>(4, 20));
  const std::size_t k = mesh.size();
  std::optional<double> noise;
  SUBCASE("exact") {}
  SUBCASE("noisy") { noise = 0.1; }
  const Settings settings = {.method = Method::detail, .noise = noise};
  Completer<float> completer(mesh.faces(), mesh.points(), settings);
  Completer<float> other(mesh.faces(), mesh.points(), settings);
  const auto frame = [&](unsigned n) { return turned(mesh.vertices, 0.1 * n); };
  push(completer, frame(9), random_mask(k, 0.5, 9));
  completer.reset({frame(1).data(), k});
  for (unsigned n = 2; n < 5; ++n) push(completer, frame(n), random_mask(k, 0.3, n));
  other.restore(completer.state());
  CHECK(other.state() == completer.state());
  for (unsigned n = 5; n < 8; ++n) {
    const auto known = random_mask(k, 0.3, n);
    CHECK(push(other, frame(n), known) == push(completer, frame(n), known));
  }
  Completer<float> motion(mesh.faces(), mesh.points());
  CHECK(message_of([&] { motion.restore(completer.state()); }).find("other settings") !=
        std::string::npos);
}

TEST_CASE("the number of threads changes nothing") {
  const auto mesh = sheet<double>(40);
  Completer<double> one(mesh.faces(), mesh.points(), detail);
  Completer<double> four(mesh.faces(), mesh.points(), {.method = Method::detail, .threads = 4});
  for (unsigned n = 1; n < 4; ++n) {
    const auto frame = turned(mesh.vertices, 0.1 * n);
    const auto known = random_mask(mesh.size(), 0.3, n);
    CHECK(push(one, frame, known) == push(four, frame, known));
  }
}

TEST_CASE("settings of motion are refused") {
  const auto mesh = sheet<double>(3);
  const auto message = [&](const Settings& settings) {
    return message_of([&] { Completer<double>(mesh.faces(), mesh.points(), settings); });
  };
  CHECK(message({.method = Method::detail, .revisit = false}).starts_with("revisit: "));
  CHECK(
      message({.method = Method::detail, .extra_iterations = 1}).starts_with("extra_iterations: "));
  CHECK(message({.method = Method::detail, .noise = 0.0}).starts_with("noise: must be positive"));
  CHECK(message({.method = Method::detail, .noise = std::numeric_limits<double>::infinity()})
            .starts_with("noise: must be positive"));
}

}  // namespace
}  // namespace dynmesh::testing
