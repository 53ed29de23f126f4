/// Method detail that learns from the frames that it completes.
#include <doctest/doctest.h>

#include <cmath>
#include <dynmesh/completer.hpp>
#include <limits>
#include <utility>
#include <vector>

#include "detail/shape_library.hpp"
#include "meshes.hpp"
#include "push.hpp"
#include "rehearsed.hpp"
#include "shared_work.hpp"
#include "support/workers.hpp"

namespace dynmesh::testing {
namespace {

TEST_CASE("of many shapes, those at regular intervals are in the library") {
  SurfaceParts parts;
  parts.offsets = {0, 1, 2};
  parts.entries = {{0, 1.0}, {0, 1.0}};
  Workers workers(1);
  ShapeLibrary library(parts, workers);
  for (std::uint64_t n = 1; n <= 2000; ++n) {
    // Shapes of one coordinate, n, at the second vertex.
    std::vector<Vector3<double>> memory(6);
    memory[4].y = -static_cast<double>(n);
    std::uint64_t interval = 2;
    while (n / interval > 31) interval *= 2;
    const bool has_entered = library.offer(memory);
    const auto members = library.members();
    REQUIRE(library.n_offered() == n);
    REQUIRE(members.size() == n / interval);
    REQUIRE(has_entered ==
            (n % (n % interval == 0 && n / interval == 16 ? interval / 2 : interval) == 0));
    for (std::size_t i = 0; i < members.size(); ++i) {
      for (std::size_t j = 0; j < members.size(); ++j) {
        const auto expected = static_cast<double>((i + 1) * (j + 1) * interval * interval);
        REQUIRE(library.product(0, members[i], members[j]) == expected);
      }
    }
  }
}

TEST_CASE("a shape out of any range does not enter") {
  SurfaceParts parts;
  parts.offsets = {0, 1};
  parts.entries = {{0, 1.0}};
  Workers workers(1);
  ShapeLibrary library(parts, workers);
  std::vector<Vector3<double>> memory(3);
  for (const double bad : {1e7, -1e300, std::numeric_limits<double>::infinity(),
                           std::numeric_limits<double>::quiet_NaN()}) {
    memory[1].z = bad;
    CHECK_FALSE(library.offer(memory));
    CHECK_FALSE(library.offer(memory));
    CHECK(library.members().empty());
    CHECK(library.rows()[0] == ShapeLibrary::Row{});
  }
}

TEST_CASE_TEMPLATE("what is learned does not depend on the number of threads", Real, float,
                   double) {
  const SharedWork shared;
  const auto mesh = sheet<Real>(24);
  Settings settings = {.method = Method::detail, .learn = true};
  SUBCASE("exact") {}
  SUBCASE("noisy") { settings.noise = 0.01; }
  Completer<Real> one(mesh.faces(), mesh.points(), settings);
  for (const Index threads : {2, 3}) {
    settings.threads = threads;
    Completer<Real> many(mesh.faces(), mesh.points(), settings);
    one.reset(mesh.points());
    for (unsigned n = 1; n < 22; ++n) {
      const auto frame = bent(mesh.vertices, 0.3 * n);
      const auto known = random_mask(mesh.size(), 0.3, n);
      std::vector<Real> completed;
      CHECK(shared_pieces([&] { completed = push(many, frame, known); }) > 0);
      REQUIRE(completed == push(one, frame, known));
    }
    CHECK(many.report().stages.explained > 0);
    CHECK(many.state() == one.state());
  }
}

TEST_CASE_TEMPLATE("extreme lengths and outliers do no harm", Real, float, double) {
  const Settings settings = {.method = Method::detail, .learn = true};
  auto mesh = join(sheet<Real>(5), sheet<Real>(2, 20));
  mesh.vertices.insert(mesh.vertices.end(), {9, 9, 9});
  const std::size_t k = mesh.size();
  const int exponent = std::numeric_limits<Real>::max_exponent / 3;
  for (const int scale : {0, -exponent, exponent}) {
    CAPTURE(scale);
    auto scaled = mesh;
    for (Real& x : scaled.vertices) x = std::ldexp(x, scale);
    Completer<Real> completer(scaled.faces(), scaled.points(), settings);
    Completer<Real> other(scaled.faces(), scaled.points(), settings);
    for (unsigned n = 0; n < 80; ++n) {
      auto frame = bent(mesh.vertices, n);
      for (Real& x : frame) x = std::ldexp(x, scale);
      if (n % 9 == 8) frame[3] *= std::pow(Real{100}, static_cast<Real>(n % 3));
      const auto known = n % 13 == 11 ? mask(k, {0}) : random_mask(k, 0.1 * (n % 6), n);
      CHECK(std::isfinite(largest(push(completer, frame, known))));
      other.restore(completer.state());
      CHECK(other.state() == completer.state());
    }
  }
}

}  // namespace
}  // namespace dynmesh::testing
