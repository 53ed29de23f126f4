#include "detail/detail.hpp"

#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <dynmesh/completer.hpp>
#include <limits>
#include <vector>

#include "meshes.hpp"
#include "push.hpp"
#include "training_data.hpp"

namespace dynmesh::testing {
namespace {

constexpr Settings detail = {.method = Method::detail};

/// A sheet stays where it is or moves as a whole for three frames, and then bends.
template <class Real>
void check_rest(const Settings& settings, double step, bool is_trained) {
  const Mesh<double> mesh = sheet<double>(10);
  const auto complete = [&](double x) {
    const auto as_real = [](const std::vector<double>& from) {
      return std::vector<Real>(from.begin(), from.end());
    };
    const Mesh<Real> first = {as_real(translated(mesh.vertices, x, -0.4 * x, 0.2 * x)),
                              mesh.indices};
    const auto shown = training_of(training_frames_of(as_real(mesh.vertices), 6));
    auto completer = is_trained ? Completer<Real>(first.faces(), first.points(), settings, shown)
                                : Completer<Real>(first.faces(), first.points(), settings);
    std::vector<std::vector<double>> results;
    for (unsigned n = 1; n <= 6; ++n) {
      auto frame = mesh.vertices;
      for (std::size_t i = 0; n > 3 && i < frame.size(); i += 3) {
        frame[i + 2] += 0.01 * (n - 3) * frame[i] * frame[i];
      }
      const double along = x + step * n;
      const auto points = as_real(translated(frame, along, -0.4 * x, 0.2 * x));
      const auto found = push(completer, points, random_mask(mesh.size(), 0.3, n));
      if (n <= (is_trained ? 3 : 4)) CHECK(completer.report().stages.blend == 0);
      if (n <= 3) CHECK(completer.report().stages.prior_share == 0);
      results.push_back(
          translated(std::vector<double>(found.begin(), found.end()), -along, 0.4 * x, -0.2 * x));
      if (n <= 3 || !settings.uncertainty) continue;
      const auto errors = completer.standard_error();
      results.emplace_back(errors.begin(), errors.end());
    }
    return results;
  };
  const auto here = complete(0);
  const auto there = complete(7.3);
  const double extent = 10 + 6 * step;
  const double rounding = 100 * extent * static_cast<double>(std::numeric_limits<Real>::epsilon());
  REQUIRE(here.size() == there.size());
  for (std::size_t i = 0; i < here.size(); ++i) {
    CHECK(largest_difference(here[i], there[i]) < rounding);
  }
}

TEST_CASE_TEMPLATE("nothing is made of the rounding errors of a subject at rest", Real, float,
                   double) {
  Settings settings = detail;
  bool is_trained = false;
  SUBCASE("exact") {}
  SUBCASE("noisy") { settings.noise = 0.01; }
  SUBCASE("learning") { settings.learn = true; }
  SUBCASE("with training") { is_trained = true; }
  SUBCASE("with error bars") { settings.uncertainty = true; }
  for (const double step : {0.0, 0.37, 30.0}) {
    CAPTURE(step);
    check_rest<Real>(settings, step, is_trained);
  }
}

TEST_CASE("noise that is too small to matter is small, however small") {
  const auto mesh = sheet<double>(8);
  const auto complete = [&](double noise) {
    Completer<double> completer(mesh.faces(), mesh.points(),
                                {.method = Method::detail, .noise = noise});
    std::vector<double> completed;
    for (unsigned n = 1; n < 8; ++n) {
      completed = push(completer, turned(mesh.vertices, 0.1 * n), random_mask(mesh.size(), 0.3, n));
    }
    return completed;
  };
  const auto expected = complete(1e-20);
  for (const double noise : {1e-155, 1e-160, 1e-170, std::numeric_limits<double>::denorm_min()}) {
    CAPTURE(noise);
    CHECK(complete(noise) == expected);
  }
  CHECK(largest_difference(complete(1), expected) > 1e-3);
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
