/// Training sequences, the shapes that are learned, and the modes of both.
#include <doctest/doctest.h>

#include <algorithm>
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

TEST_CASE("the products are the same for every kind of processor, up to rounding") {
  const SurfaceParts parts = some_parts();
  const std::vector<Index>& part_of = parts.parts;
  std::vector<float> values(3 * modes_of_part * part_of.size());
  std::mt19937 random(5);
  std::normal_distribution<float> normal;
  for (float& x : values) x = normal(random);
  const ModeData data = {parts.offsets.data(), part_of.data(), values.data()};
  const std::size_t n = modes_of_part * static_cast<std::size_t>(parts.n_parts);
  const auto field = random_field(n_vertices, 2);
  const auto given = random_numbers(n + n_vertices, 4);
  const std::vector<float> coefficients(given.begin(), given.begin() + n);
  const std::vector<double> weights(given.begin() + n, given.end());

  // The sums in double precision.
  std::vector<Vector3> combined(n_vertices);
  std::vector<double> projected(n);
  std::vector<double> squares(n);
  constexpr Index first = 3;
  constexpr Index last = 250;
  for (Index v = first; v < last; ++v) {
    for (Index e = parts.offsets[v]; e < parts.offsets[v + 1]; ++e) {
      for (std::size_t j = 0; j < modes_of_part; ++j) {
        const float* mode = &values[3 * modes_of_part * e + j];
        const Vector3 b = {mode[0], mode[modes_of_part], mode[2 * modes_of_part]};
        const std::size_t c = modes_of_part * part_of[e] + j;
        combined[v] = combined[v] + static_cast<double>(coefficients[c]) * b;
        projected[c] += b.x * field[v].x + b.y * field[v].y + b.z * field[v].z;
        squares[c] += weights[v] * squared_norm(b);
      }
    }
  }
  for (const Kernels& level : runnable_kernels()) {
    const ModeKernels& kernels = level.modes;
    constexpr double untouched = 7;
    std::vector<Vector3> of_level(n_vertices, {untouched, untouched, untouched});
    kernels.combine(data, coefficients.data(), of_level.data(), first, last);
    for (Index v = 0; v < static_cast<Index>(n_vertices); ++v) {
      const bool is_inside = v >= first && v < last;
      const Vector3 expected = is_inside ? combined[v] : Vector3{untouched, untouched, untouched};
      CHECK(squared_norm(of_level[v] - expected) < 1e-8);
    }
    std::vector<float> sums(n, 1);
    kernels.project(data, field.data(), nullptr, sums.data(), nullptr, first, last);
    for (std::size_t c = 0; c < n; ++c) {
      CHECK(sums[c] == doctest::Approx(1 + projected[c]).epsilon(1e-4));
    }
    std::ranges::fill(sums, 1.0F);
    std::vector<float> sums_of_squares(n, 1);
    kernels.project(data, field.data(), weights.data(), sums.data(), sums_of_squares.data(), first,
                    last);
    for (std::size_t c = 0; c < n; ++c) {
      CHECK(sums[c] == doctest::Approx(1 + projected[c]).epsilon(1e-4));
      CHECK(sums_of_squares[c] == doctest::Approx(1 + squares[c]).epsilon(1e-4));
    }
  }
}

TEST_CASE("all kernels form modes and multiply shapes") {
  constexpr std::size_t slots = 32;
  const SurfaceParts parts = some_parts();
  const std::vector<Index>& part_of = parts.parts;
  const std::vector<float> weights(parts.weights.begin(), parts.weights.end());
  const auto n_parts = static_cast<std::size_t>(parts.n_parts);
  const auto given = random_numbers(3 * slots * n_vertices + n_parts * slots * modes_of_part, 6);
  const auto end_of_shapes = given.begin() + 3 * slots * n_vertices;
  std::vector<float> shapes(given.begin(), end_of_shapes);
  std::vector<float> factors(end_of_shapes, given.end());
  const std::vector<Index> chosen = {5, 0, 31, 17, 8};
  const ModeData entries = {parts.offsets.data(), part_of.data(), nullptr};
  const ShapeData data = {shapes.data(), slots, weights.data()};
  const CombinationData combination = {chosen.data(), static_cast<Index>(chosen.size()),
                                       factors.data()};
  const auto shape = [&](std::size_t v, std::size_t c, Index slot) {
    return static_cast<double>(shapes[(3 * v + c) * slots + static_cast<std::size_t>(slot)]);
  };
  constexpr Index first = 3;
  constexpr Index last = 250;
  constexpr Index slot = 17;
  for (const Kernels& level : runnable_kernels()) {
    std::vector<float> values(3 * modes_of_part * part_of.size(), 7);
    level.modes.form(entries, data, combination, values.data(), first, last);
    std::vector<double> sums(n_parts * slots, 1);
    level.modes.add_products(entries, data, slot, sums.data(), first, last);
    std::vector<double> products(n_parts * slots, 1);
    for (std::size_t v = 0; v < n_vertices; ++v) {
      const bool is_inside = v >= first && v < last;
      for (Index e = parts.offsets[v]; e < parts.offsets[v + 1]; ++e) {
        const auto part = static_cast<std::size_t>(part_of[e]);
        for (std::size_t c = 0; c < 3; ++c) {
          for (std::size_t j = 0; j < modes_of_part; ++j) {
            double expected = 0;
            for (std::size_t l = 0; l < chosen.size(); ++l) {
              expected += weights[e] * shape(v, c, chosen[l]) *
                          factors[(part * chosen.size() + l) * modes_of_part + j];
            }
            if (!is_inside) expected = 7;
            const float found = values[(3 * e + c) * modes_of_part + j];
            REQUIRE(found == doctest::Approx(expected).epsilon(1e-5));
          }
          for (Index l = 0; is_inside && l < static_cast<Index>(slots); ++l) {
            products[part * slots + l] += weights[e] * shape(v, c, slot) * shape(v, c, l);
          }
        }
      }
    }
    for (std::size_t i = 0; i < products.size(); ++i) {
      CHECK(sums[i] == doctest::Approx(products[i]).epsilon(1e-12));
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
