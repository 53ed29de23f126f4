#include <doctest/doctest.h>

#include <dynmesh/completer.hpp>

#include "meshes.hpp"
#include "support/rigid_motion.hpp"

namespace dynmesh::testing {
namespace {

/// A sheet of 25 vertices, one of 16 vertices beside it, and an isolated vertex.
Mesh<double> three_parts() {
  auto mesh = join(sheet<double>(5), sheet<double>(4, 6.0));
  mesh.vertices.insert(mesh.vertices.end(), {2.0, 2.0, 1.0});
  return mesh;
}

std::vector<double> complete(const Mesh<double>& mesh, const std::vector<double>& moved,
                             const std::vector<std::uint8_t>& known, DisconnectedRule rule) {
  Completer<double> completer(mesh.faces(), mesh.points(), {.disconnected = rule});
  std::vector<double> completed(moved.size());
  completer.push({moved.data(), mesh.size()}, {known.data(), known.size()},
                 {completed.data(), mesh.size()});
  return completed;
}

TEST_CASE("points turn about a line unless they are nearer to it than rounding") {
  const std::vector<Index> chosen = {0, 1, 2, 3};
  for (const double width : {1e-1, 1e-3, 1e-4, 1e-6}) {
    const std::vector<Vector3<double>> before = {
        {0, 0, -1}, {0, 0, 1}, {width, 0, 0}, {-width, 0, 0}};
    const std::vector<Vector3<double>> after = {
        {0, 0, -1}, {0, 0, 1}, {0, width, 0}, {0, -width, 0}};
    const auto motion = fit_rigid_motion<double>(chosen, before, after);
    const auto turned = motion.apply(Vector3<double>{1, 0, 0});
    CHECK(turned.x == doctest::Approx(width > 1e-5 ? 0 : 1));
    CHECK(turned.y == doctest::Approx(width > 1e-5 ? 1 : 0));
  }
}

TEST_CASE("collinear anchors, or fewer than three, give their mean translation") {
  Mesh<double> mesh = three_parts();
  auto moved = turned(mesh.vertices, 1.5);
  for (const auto& known : {mask(mesh.size(), {0, 1}), mask(mesh.size(), {7})}) {
    const auto completed = complete(mesh, moved, known, DisconnectedRule::follow);
    double mean[3] = {0, 0, 0};
    double count = 0;
    for (std::size_t v = 0; v < mesh.size(); ++v) {
      if (known[v] == 0) continue;
      ++count;
      for (std::size_t c = 0; c < 3; ++c) mean[c] += moved[3 * v + c] - mesh.vertices[3 * v + c];
    }
    for (std::size_t c = 0; c < 3; ++c) {
      const std::size_t single = 3 * (mesh.size() - 1) + c;
      CHECK(completed[single] == doctest::Approx(mesh.vertices[single] + mean[c] / count));
    }
  }
}

TEST_CASE("a mirrored neighbour does not mirror the component that follows it") {
  const auto mesh = three_parts();
  auto moved = mesh.vertices;
  for (std::size_t i = 0; i < moved.size(); i += 3) moved[i] = -moved[i];
  auto known = std::vector<std::uint8_t>(mesh.size(), 0);
  std::fill_n(known.begin(), 25, std::uint8_t{1});
  const auto completed = complete(mesh, moved, known, DisconnectedRule::follow);
  const auto volume = [&](const std::vector<double>& v) {  // at a corner of the second sheet
    const auto edge = [&](std::size_t to, std::size_t c) {
      return v[3 * (25 + to) + c] - v[75 + c];
    };
    double sum = 0;
    for (std::size_t c = 0; c < 3; ++c) {
      const std::size_t d = (c + 1) % 3;
      const std::size_t e = (c + 2) % 3;
      sum += edge(1, c) * (edge(4, d) * edge(10, e) - edge(4, e) * edge(10, d));
    }
    return sum;
  };
  CHECK(volume(completed) == doctest::Approx(volume(mesh.vertices)));
}

}  // namespace
}  // namespace dynmesh::testing
