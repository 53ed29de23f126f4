#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <dynmesh/training.hpp>
#include <limits>
#include <stdexcept>

#include "meshes.hpp"
#include "push.hpp"
#include "training_data.hpp"

namespace dynmesh::testing {
namespace {

TEST_CASE("of many frames, those at regular intervals are kept") {
  Training<float> training(1);
  for (std::size_t n = 1; n <= 1300; ++n) {
    const float x[] = {static_cast<float>(n - 1), 0, 0};
    training.add({x, 1});
    std::size_t interval = 1;
    while ((n + interval - 1) / interval > 75) interval *= 2;
    const auto kept = training.frames();
    REQUIRE(training.n_added() == n);
    REQUIRE(kept.size() == (n + interval - 1) / interval);
    for (std::size_t i = 0; i < kept.size(); ++i) {
      REQUIRE(kept[i].size() == 3);
      REQUIRE(kept[i][0] == static_cast<float>(i * interval));
    }
  }
}

TEST_CASE("frames of any layout are kept packed") {
  const auto mesh = sheet<double>(4);
  const std::size_t k = mesh.size();
  std::vector<double> planar(3 * k);
  for (std::size_t i = 0; i < 3 * k; ++i) planar[i % 3 * k + i / 3] = mesh.vertices[i];
  Training<double> training(k);
  training.add({planar.data(), k, 1, static_cast<std::ptrdiff_t>(k)});
  CHECK(training.frames()[0] == mesh.vertices);
}

TEST_CASE("a frame that is refused changes nothing") {
  const auto shown = training_frames_of(sheet<float>(3).vertices, 4);
  Training<float> training(9);
  for (const auto& frame : shown) training.add({frame.data(), 9});
  for (const float bad : {std::numeric_limits<float>::quiet_NaN(), 1e30F}) {
    auto frame = shown[0];
    frame[13] = bad;
    CHECK_THROWS_AS(training.add({frame.data(), 9}), std::invalid_argument);
  }
  CHECK_THROWS_AS(training.add({shown[0].data(), 8}), std::invalid_argument);
  CHECK(training.n_added() == 4);
  CHECK(std::ranges::equal(training.frames(), shown));
}

TEST_CASE("a distant anchor does not affect later frames") {
  const auto mesh = sheet<double>(9);
  auto completer = trained(mesh);
  const auto known = [&](unsigned n) {
    auto mask = random_mask(mesh.size(), 0.5, n);
    mask[40] = 1;
    return mask;
  };
  for (const double distance : {1e9, 1e30, 1e100, 1e200}) {
    CAPTURE(distance);
    auto outlier = mesh.vertices;
    outlier[120] = distance;
    CHECK(largest(push(completer, outlier, known(1))) <= 1e200);
    CHECK(largest(push(completer, outlier, known(2))) <= 1e200);
    completer.restore(completer.state());
    push(completer, mesh.vertices, std::vector<std::uint8_t>(mesh.size(), 1));
    for (unsigned n = 3; n < 8; ++n) push(completer, mesh.vertices, known(n));
    const auto completed = push(completer, mesh.vertices, known(8));
    CHECK(largest_difference(completed, mesh.vertices) < 1e-2);
  }
}

TEST_CASE_TEMPLATE("a training sequence that moves as a whole is not used, and changes nothing",
                   Real, float, double) {
  const auto mesh = sheet<Real>(10);
  std::vector<std::vector<Real>> shown;
  Real shift = 0;
  SUBCASE("in place") {}
  SUBCASE("far away") { shift = 2000; }
  for (int n = 0; n < 8; ++n) {
    const Real along = static_cast<Real>(n) * shift;
    shown.push_back(translated(turned(mesh.vertices, 0.3 * n), along, along, Real{0}));
  }
  const Settings detail = {.method = Method::detail};
  Completer<Real> with(mesh.faces(), mesh.points(), detail, training_of(shown));
  Completer<Real> without(mesh.faces(), mesh.points(), detail);
  for (unsigned n = 1; n < 16; ++n) {
    auto frame = n < 8 ? mesh.vertices : bent(mesh.vertices, 0.1 * (n - 7));
    frame = translated(frame, static_cast<Real>(0.37 * n), Real{0}, Real{0});
    const auto known = random_mask(mesh.size(), 0.3, n);
    CHECK(push(with, frame, known) == push(without, frame, known));
    CHECK(with.report().stages.prior_weight == 0);
  }
}

TEST_CASE("after a rest, the pose does not depend on rounding errors") {
  Mesh<double> mesh = sheet<double>(3);
  for (int n = 1; n < 8; ++n) mesh = join(mesh, sheet<double>(3, 5.0 * n));
  for (std::size_t i = 0; i < mesh.vertices.size(); ++i) {
    mesh.vertices[i] += 0.1 * std::sin(static_cast<double>(7 * i * i));  // no two edges are equal
  }
  const auto complete = [&](double shift) {
    const auto moved = [&](const std::vector<double>& frame) {
      return translated(turned(frame, 0.7), shift, shift, shift);
    };
    Mesh<double> elsewhere = mesh;
    elsewhere.vertices = moved(mesh.vertices);
    const std::vector<std::vector<double>> shown(3, moved(bent(mesh.vertices, 0.5)));
    Completer<double> completer(elsewhere.faces(), elsewhere.points(), {.method = Method::detail},
                                training_of(shown));
    push(completer, translated(elsewhere.vertices, 0.1, 0.2, 0.3),
         random_mask(mesh.size(), 0.05, 1));
    const auto completed =
        push(completer, moved(bent(mesh.vertices, 1)), random_mask(mesh.size(), 0.8, 2));
    CHECK(completer.report().stages.prior_weight > 0);
    return translated(completed, -shift, -shift, -shift);
  };
  const auto expected = complete(0);
  for (const double shift : {0.01, 0.3, 7.3, -100.0}) {
    CHECK(largest_difference(complete(shift), expected) < 1e-9);
  }
}

}  // namespace
}  // namespace dynmesh::testing
