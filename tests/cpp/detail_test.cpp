#include "detail/detail.hpp"

#include <doctest/doctest.h>

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

}  // namespace
}  // namespace dynmesh::testing
