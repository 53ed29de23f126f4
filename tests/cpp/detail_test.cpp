#include "detail/detail.hpp"

#include <doctest/doctest.h>

#include <dynmesh/completer.hpp>
#include <optional>

#include "meshes.hpp"
#include "push.hpp"
#include "shared_work.hpp"

namespace dynmesh::testing {
namespace {

constexpr Settings detail = {.method = Method::detail};

TEST_CASE("a translation is completed exactly, and a rotation approximately") {
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

TEST_CASE("a completer continues from its state with identical results") {
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

TEST_CASE("the result does not depend on the number of threads") {
  const SharedWork shared;
  const auto mesh = sheet<double>(24);
  std::optional<double> noise;
  SUBCASE("exact") {}
  SUBCASE("noisy") { noise = 0.01; }
  Settings settings = {.method = Method::detail, .noise = noise, .reject_outliers = true};
  Completer<double> one(mesh.faces(), mesh.points(), settings);
  for (const Index threads : {2, 3}) {
    settings.threads = threads;
    Completer<double> many(mesh.faces(), mesh.points(), settings);
    one.reset(mesh.points());
    for (unsigned n = 1; n < 4; ++n) {
      const auto frame = turned(mesh.vertices, 0.1 * n);
      const auto known = random_mask(mesh.size(), 0.3, n);
      std::vector<double> completed;
      CHECK(shared_pieces([&] { completed = push(many, frame, known); }) > 0);
      CHECK(completed == push(one, frame, known));
    }
  }
}

}  // namespace
}  // namespace dynmesh::testing
