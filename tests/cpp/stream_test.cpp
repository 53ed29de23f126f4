/// Completers: what goes on around the estimation of a frame.
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <dynmesh/completer.hpp>
#include <limits>
#include <random>
#include <set>
#include <vector>

#include "base/geometry.hpp"
#include "base/overlap.hpp"
#include "frame/outliers.hpp"
#include "mesh/ties.hpp"
#include "meshes.hpp"

namespace dynmesh::testing {
namespace {

TEST_CASE("frames in float are those in double, rounded once; by method motion nearly") {
  const auto mesh = join(sheet<float>(12), sheet<float>(3, 20));
  const std::size_t k = mesh.size();
  const std::vector<double> vertices(mesh.vertices.begin(), mesh.vertices.end());
  for (const Settings& settings :
       {Settings{.method = Method::motion}, Settings{.method = Method::motion, .revisit = false},
        Settings{.uncertainty = true}, Settings{.noise = 0.01, .reject_outliers = true}}) {
    CAPTURE(settings.noise.has_value());
    CAPTURE(settings.uncertainty);
    Completer<float> of_floats(mesh.faces(), mesh.points(), settings);
    Completer<double> of_doubles(mesh.faces(), {vertices.data(), k}, settings);
    std::vector<float> found(3 * k);
    std::vector<double> expected(3 * k);
    for (unsigned n = 1; n < 10; ++n) {
      // Not rigid: what is then left of a shape are rounding errors.
      const auto frame = bent(mesh.vertices, 0.3 * n);
      const std::vector<double> same(frame.begin(), frame.end());
      const auto known = random_mask(k, 0.03 * n, n);
      of_floats.push({frame.data(), k}, {known.data(), k}, {found.data(), k});
      of_doubles.push({same.data(), k}, {known.data(), k}, {expected.data(), k});
      const double size = 24;  // of the coordinates
      const double rounding = size * std::numeric_limits<float>::epsilon();
      const bool is_exact = settings.method == Method::detail;
      for (std::size_t i = 0; i < 3 * k; ++i) {
        const double error =
            std::abs(found[i] - static_cast<double>(static_cast<float>(expected[i])));
        CHECK(error <= (is_exact ? 0 : 2 * rounding));
      }
    }
  }
}

/// The addresses of all bytes of an extent.
std::multiset<std::intptr_t> bytes_of(const Extent& e) {
  std::multiset<std::intptr_t> bytes;
  for (std::size_t row = 0; row < e.rows; ++row) {
    for (std::size_t column = 0; column < e.columns; ++column) {
      for (std::size_t b = 0; b < e.size; ++b) {
        bytes.insert(e.address + static_cast<std::ptrdiff_t>(row) * e.row_pitch +
                     static_cast<std::ptrdiff_t>(column) * e.column_pitch +
                     static_cast<std::ptrdiff_t>(b));
      }
    }
  }
  return bytes;
}

bool share(const Extent& a, const Extent& b) {
  const auto of_b = bytes_of(b);
  for (const auto byte : bytes_of(a)) {
    if (of_b.contains(byte)) return true;
  }
  return false;
}

TEST_CASE("overlap is exact for equal pitches and conservative otherwise") {
  std::mt19937 random(7);
  const auto draw = [&](int low, int high) {
    return std::uniform_int_distribution(low, high)(random);
  };
  int met = 0;
  for (int trial = 0; trial < 20000; ++trial) {
    const std::ptrdiff_t pitch = draw(-20, 20);
    const auto extent = [&](std::ptrdiff_t row_pitch) {
      return Extent{draw(0, 60), static_cast<std::size_t>(draw(0, 5)),
                    row_pitch,   static_cast<std::size_t>(draw(1, 3)),
                    draw(-8, 8), static_cast<std::size_t>(draw(1, 4))};
    };
    const Extent a = extent(pitch);
    const Extent b = extent(draw(0, 2) == 0 ? draw(-20, 20) : static_cast<int>(pitch));
    met += share(a, b) ? 1 : 0;
    if (a.row_pitch == b.row_pitch) {
      CHECK(overlap(a, b) == share(a, b));
    } else if (share(a, b)) {
      CHECK(overlap(a, b));
    }

    std::set<std::intptr_t> distinct;
    const auto bytes = bytes_of(a);
    distinct.insert(bytes.begin(), bytes.end());
    if (a.rows > 0) CHECK(overlaps_itself(a) == (distinct.size() < bytes.size()));
  }
  CHECK(met > 1000);
}

TEST_CASE("donors are the nearest vertices of other components") {
  for (unsigned seed = 0; seed < 40; ++seed) {
    std::mt19937 random(seed);
    std::uniform_int_distribution<Index> label(0, static_cast<Index>(seed % 7));
    std::uniform_int_distribution<int> coordinate(0,
                                                  seed % 2 == 0 ? 3 : 1000);  // many ties, or few
    std::vector<Vector3> frame(300);
    std::vector<Index> component(frame.size());
    for (std::size_t v = 0; v < frame.size(); ++v) {
      frame[v] = {static_cast<double>(coordinate(random)), static_cast<double>(coordinate(random)),
                  static_cast<double>(coordinate(random))};
      component[v] = label(random);
    }
    const auto donors = find_donors(frame, component);
    for (std::size_t v = 0; v < frame.size(); ++v) {
      double nearest = std::numeric_limits<double>::infinity();
      for (std::size_t n = 0; n < frame.size(); ++n) {
        const double distance = squared_norm(frame[v] - frame[n]);
        if (component[v] != component[n]) nearest = std::min(nearest, distance);
      }
      REQUIRE((donors[v] < 0) == std::isinf(nearest));
      if (donors[v] < 0) continue;
      const auto donor = static_cast<std::size_t>(donors[v]);
      CHECK(component[donor] != component[v]);
      CHECK(squared_norm(frame[v] - frame[donor]) == nearest);
    }
  }
}

TEST_CASE("only anchors that move away from their neighbours are rejected") {
  const auto mesh = sheet<double>(20);
  const Topology topology = build_topology(mesh.faces(), mesh.size());
  const auto previous = rows_of(mesh.vertices);
  Outliers outliers(topology.cells, previous);
  for (const double share : {0.05, 0.3, 1.0}) {
    auto known = random_mask(mesh.size(), share, 3);
    auto points = rows_of(turned(mesh.vertices, 0.2));
    CHECK(outliers.drop(previous, points, known) == 0);

    auto expected = known;
    const std::vector<std::size_t> far_away = {0, 57, 210, 399};
    for (const std::size_t v : far_away) {
      points[v] = points[v] + Vector3{0, 6, -8};
      known[v] = 1;
      expected[v] = 0;
    }
    CHECK(outliers.drop(previous, points, known) == far_away.size());
    CHECK(known == expected);
  }
}

TEST_CASE("a limb that starts to move on a body at rest is not rejected, in any unit") {
  for (const double unit : {1.0, 1e6}) {
    auto mesh = sheet<double>(20);
    for (double& x : mesh.vertices) x *= unit;
    const Topology topology = build_topology(mesh.faces(), mesh.size());
    const auto previous = rows_of(mesh.vertices);
    auto points = previous;
    for (std::size_t v = 0; v < 100; ++v) {  // the first five rows, the farther the more
      points[v].z += 4e-4 * unit * static_cast<double>(5 - v / 20);
    }
    points[210].z += 4e-3 * unit;  // and one vertex alone, which may be noise
    Outliers outliers(topology.cells, previous);
    std::vector<std::uint8_t> known(mesh.size(), 1);
    CHECK(outliers.drop(previous, points, known) == 0);
  }
}

TEST_CASE("with few anchors in its component, none is rejected") {
  const auto mesh = join(sheet<double>(5), sheet<double>(8, 20));
  const Topology topology = build_topology(mesh.faces(), mesh.size());
  const auto previous = rows_of(mesh.vertices);
  auto points = previous;
  points[3].x = 100;
  Outliers outliers(topology.cells, previous);
  std::vector<std::uint8_t> known(mesh.size());
  std::fill(known.begin() + 25, known.end(), std::uint8_t{1});  // the other component rests
  known[3] = known[10] = known[20] = 1;
  CHECK(outliers.drop(previous, points, known) == 0);
  known[21] = 1;
  CHECK(outliers.drop(previous, points, known) == 1);
  CHECK(known[3] == 0);
}

}  // namespace
}  // namespace dynmesh::testing
