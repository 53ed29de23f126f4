/// Training sequences, the shapes that are learned, and the modes of both.
#include <doctest/doctest.h>

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <dynmesh/training.hpp>
#include <limits>
#include <random>
#include <stdexcept>
#include <vector>

#include "base/workers.hpp"
#include "meshes.hpp"
#include "shape/modes.hpp"
#include "shape/shape_library.hpp"
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

constexpr std::size_t n_vertices = 600;  // more than two chunks
constexpr std::size_t n_frames = 20;

/// Overlapping parts without a mesh: each vertex in the global part and in up to two others.
SurfaceParts some_parts() {
  SurfaceParts parts;
  parts.n_parts = 4;
  const auto add = [&](Index part, double weight) {
    parts.parts.push_back(part);
    parts.weights.push_back(weight);
  };
  for (std::size_t v = 0; v < n_vertices; ++v) {
    add(0, 1.0);
    const double share = 0.2 + 0.6 * static_cast<double>(v) / n_vertices;
    const Index part = 1 + static_cast<Index>(v / 300);
    if (v % 5 != 0) add(part, share);
    if (v % 5 > 1) add(part + 1, 1 - share);
    parts.offsets.push_back(static_cast<Index>(parts.parts.size()));
  }
  return parts;
}

std::vector<double> random_numbers(std::size_t n, unsigned seed) {
  std::mt19937 random(seed);
  std::normal_distribution<double> normal;
  std::vector<double> numbers(n);
  for (double& x : numbers) x = normal(random);
  return numbers;
}

TEST_CASE("modes that are too small to be seen, in mean edges or by rounding, are none") {
  const SurfaceParts parts = some_parts();
  const auto shapes = random_field(n_vertices * n_frames, 3);
  Workers workers(1);
  const auto number = [&](double size, double mean_edge, double rounding) {
    Modes modes(parts, mean_edge);
    ShapeLibrary library(modes, n_frames, mean_edge, rounding, workers);
    for (std::size_t n = 0; n < n_frames; ++n) {
      library.add([&](std::size_t v) { return size * shapes[v * n_frames + n]; });
    }
    library.make(modes);
    return modes.size();
  };
  for (const double h : {1e-12, 1.0, 1e12}) {
    CHECK(number(1e-5 * h, h, 0) == 0);
    CHECK(number(1e-2 * h, h, 0) == 4 * 16);
    CHECK(number(1e-2 * h, h, 1e-2 * h * h) == 0);
  }
}

TEST_CASE("modes are formed, combined and projected on, up to rounding") {
  constexpr std::size_t slots = 32;
  const SurfaceParts parts = some_parts();
  const auto n_parts = static_cast<std::size_t>(parts.n_parts);
  const std::vector<Index> chosen = {5, 0, 31, 17, 8};
  const auto floats = [](std::size_t n, unsigned seed) {
    const auto numbers = random_numbers(n, seed);
    return std::vector<float>(numbers.begin(), numbers.end());
  };
  const auto shapes = floats(3 * slots * n_vertices, 6);
  const auto factors = floats(n_parts * chosen.size() * modes_of_part, 7);
  Workers workers(1);
  Modes modes(parts, 3);  // in the unit 2
  const std::size_t n = modes.n_coefficients();
  modes.form({shapes, chosen, factors}, n, workers);
  const auto field = random_field(n_vertices, 2);
  const auto coefficients = random_numbers(n, 4);
  const auto weights = random_numbers(n_vertices, 5);

  // The sums in double precision.
  std::vector<Vector3> combined(n_vertices);
  std::vector<double> projected(n), squares(n);
  for (std::size_t v = 0; v < n_vertices; ++v) {
    for (Index e = parts.offsets[v]; e < parts.offsets[v + 1]; ++e) {
      const auto part = static_cast<std::size_t>(parts.parts[e]);
      for (std::size_t j = 0; j < modes_of_part; ++j) {
        double b[3] = {};
        for (std::size_t l = 0; l < chosen.size(); ++l) {
          for (std::size_t c = 0; c < 3; ++c) {
            b[c] += 2 * parts.weights[e] *
                    shapes[(3 * v + c) * slots + static_cast<std::size_t>(chosen[l])] *
                    factors[(part * chosen.size() + l) * modes_of_part + j];
          }
        }
        const Vector3 mode = {b[0], b[1], b[2]};
        const std::size_t i = modes_of_part * part + j;
        combined[v] = combined[v] + coefficients[i] * mode;
        projected[i] += dot(mode, field[v]);
        squares[i] += weights[v] * squared_norm(mode);
      }
    }
  }
  ModeSums sums(n_vertices, n);
  std::vector<Vector3> found(n_vertices);
  modes.combine(coefficients, found, sums, workers);
  for (std::size_t v = 0; v < n_vertices; ++v) {
    CHECK(squared_norm(found[v] - combined[v]) < 1e-7);
  }
  std::vector<double> alone(n), projections(n), found_squares(n);
  modes.project(field, alone, {}, {}, sums, workers);
  modes.project(field, projections, weights, found_squares, sums, workers);
  CHECK(alone == projections);
  for (std::size_t i = 0; i < n; ++i) {
    CHECK(projections[i] == doctest::Approx(projected[i]).epsilon(1e-4).scale(100));
    CHECK(found_squares[i] == doctest::Approx(squares[i]).epsilon(1e-4).scale(100));
  }
}

TEST_CASE("the modes of a part are those of the weighted products of shapes") {
  const SurfaceParts parts = some_parts();
  const auto shapes = random_field(n_vertices * n_frames, 3);
  const auto shape = [&](std::size_t n, std::size_t v) { return shapes[v * n_frames + n]; };
  Workers workers(1);
  Modes modes(parts, 1);
  ShapeLibrary library(modes, n_frames, 1, 0, workers);
  for (std::size_t n = 0; n < n_frames; ++n) {
    library.add([&](std::size_t v) { return shape(n, v); });
  }
  library.make(modes);
  const std::size_t n = modes.n_coefficients();
  ModeSums sums(n_vertices, n);
  // With the eigenvectors U and the eigenvalues of a part, the products B^T z with all shapes z are
  // U times the eigenvalues, so that those of different modes are orthogonal.
  std::vector<std::vector<double>> of_shapes;
  std::vector<Vector3> z(n_vertices);
  for (std::size_t l = 0; l < n_frames; ++l) {
    for (std::size_t v = 0; v < n_vertices; ++v) z[v] = shape(l, v);
    modes.project(z, of_shapes.emplace_back(n), {}, {}, sums, workers);
  }
  const auto product = [&](std::size_t i, std::size_t j) {
    double sum = 0;
    for (const auto& products : of_shapes) sum += products[i] * products[j];
    return sum;
  };
  for (std::size_t i = 0; i < n; ++i) {
    for (std::size_t j = i / modes_of_part * modes_of_part; j < i; ++j) {
      CHECK(product(i, i) > 0);
      CHECK(product(i, i) <= product(j, j) * (1 + 1e-4));
      CHECK(std::abs(product(i, j)) < 1e-4 * std::sqrt(product(i, i) * product(j, j)));
    }
  }
}

SurfaceParts parts_of(const Mesh<double>& mesh, Index local_parts) {
  const Topology topology = build_topology(mesh.faces(), mesh.size());
  return divide_surface(topology.cells, rows_of(mesh.vertices), local_parts);
}

TEST_CASE("what no seed reaches has the global part alone") {
  auto mesh = join(sheet<double>(8), sheet<double>(3, 100));
  // A single seed has no second nearest one, so there is no typical distance.
  CHECK(parts_of(mesh, 1).n_parts == 1);
  mesh = join(sheet<double>(12), sheet<double>(2, 5));  // both seeds on the first sheet
  const SurfaceParts parts = parts_of(mesh, 2);
  CHECK(parts.n_parts == 3);
  REQUIRE(parts.offsets.size() == mesh.size() + 1);
  for (std::size_t v = 0; v < mesh.size(); ++v) {
    CHECK((parts.offsets[v + 1] - parts.offsets[v] > 1) == (v < 144));
  }
}

}  // namespace
}  // namespace dynmesh::testing
