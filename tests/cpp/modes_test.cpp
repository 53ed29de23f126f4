#include "detail/modes.hpp"

#include <doctest/doctest.h>

#include <random>

#include "meshes.hpp"
#include "support/large_vector.hpp"

namespace dynmesh::testing {
namespace {

constexpr std::size_t n_vertices = 600;  // more than two chunks
constexpr std::size_t n_frames = 20;

/// Overlapping parts without a mesh: each vertex in the global part and in up to two others.
SurfaceParts some_parts() {
  SurfaceParts parts;
  parts.n_parts = 4;
  parts.offsets = {0};
  for (std::size_t v = 0; v < n_vertices; ++v) {
    parts.entries.push_back({0, 1.0});
    const double share = 0.2 + 0.6 * static_cast<double>(v) / n_vertices;
    const Index part = 1 + static_cast<Index>(v / 300);
    if (v % 5 != 0) parts.entries.push_back({part, share});
    if (v % 5 > 1) parts.entries.push_back({part + 1, 1 - share});
    parts.offsets.push_back(static_cast<Index>(parts.entries.size()));
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
  const auto shapes_of = [](double size) {
    auto shapes = random_field(n_vertices * n_frames, 3);
    for (auto& x : shapes) x = size * x;
    return shapes;
  };
  const auto number = [&](double size, const ModeScale& scale) {
    return Modes(parts, shapes_of(size), n_frames, {}, scale).size();
  };
  for (const double h : {1e-12, 1.0, 1e12}) {
    CHECK(number(1e-5 * h, {h, 0}) == 0);
    CHECK(number(1e-2 * h, {h, 0}) == 4 * 16);
    CHECK(number(1e-2 * h, {h, 1e-2 * h * h}) == 0);
  }
}

TEST_CASE("the products are the same for every kind of processor, up to rounding") {
  const SurfaceParts parts = some_parts();
  std::vector<Index> part_of;
  for (const auto& entry : parts.entries) part_of.push_back(entry.part);
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
  std::vector<Vector3<double>> combined(n_vertices);
  std::vector<double> projected(n);
  std::vector<double> squares(n);
  constexpr Index first = 3;
  constexpr Index last = 250;
  for (Index v = first; v < last; ++v) {
    for (Index e = parts.offsets[v]; e < parts.offsets[v + 1]; ++e) {
      for (std::size_t j = 0; j < modes_of_part; ++j) {
        const float* mode = &values[3 * modes_of_part * e + j];
        const Vector3<double> b = {mode[0], mode[modes_of_part], mode[2 * modes_of_part]};
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
    std::vector<Vector3<double>> of_level(n_vertices, {untouched, untouched, untouched});
    kernels.combine(data, coefficients.data(), of_level.data(), first, last);
    for (Index v = 0; v < static_cast<Index>(n_vertices); ++v) {
      const bool is_inside = v >= first && v < last;
      const Vector3<double> expected =
          is_inside ? combined[v] : Vector3<double>{untouched, untouched, untouched};
      CHECK(squared_norm(of_level[v] - expected) < 1e-8);
    }
    std::vector<float> sums(n, 1);
    kernels.project(data, field.data(), sums.data(), first, last);
    for (std::size_t c = 0; c < n; ++c) {
      CHECK(sums[c] == doctest::Approx(1 + projected[c]).epsilon(1e-4));
    }
    std::ranges::fill(sums, 1.0F);
    std::vector<float> sums_of_squares(n, 1);
    kernels.project_and_weigh(data, field.data(), weights.data(), sums.data(),
                              sums_of_squares.data(), first, last);
    for (std::size_t c = 0; c < n; ++c) {
      CHECK(sums[c] == doctest::Approx(1 + projected[c]).epsilon(1e-4));
      CHECK(sums_of_squares[c] == doctest::Approx(1 + squares[c]).epsilon(1e-4));
    }
  }
}

TEST_CASE("all kernels form modes and multiply shapes") {
  constexpr std::size_t slots = most_learned_shapes;
  const SurfaceParts parts = some_parts();
  std::vector<Index> part_of;
  std::vector<float> weights;
  for (const auto& [part, weight] : parts.entries) {
    part_of.push_back(part);
    weights.push_back(static_cast<float>(weight));
  }
  const auto n_parts = static_cast<std::size_t>(parts.n_parts);
  const auto given = random_numbers(3 * slots * n_vertices + n_parts * slots * modes_of_part, 6);
  const auto end_of_shapes = given.begin() + 3 * slots * n_vertices;
  LargeVector<float> shapes(given.begin(), end_of_shapes);
  LargeVector<float> factors(end_of_shapes, given.end());
  const std::vector<Index> chosen = {5, 0, 31, 17, 8};
  const ModeData entries = {parts.offsets.data(), part_of.data(), nullptr};
  const ShapeData data = {shapes.data(), weights.data()};
  const CombinationData combination = {chosen.data(), static_cast<Index>(chosen.size()),
                                       factors.data()};
  const auto shape = [&](std::size_t v, std::size_t c, Index slot) {
    return static_cast<double>(shapes[(3 * v + c) * slots + static_cast<std::size_t>(slot)]);
  };
  constexpr Index first = 3;
  constexpr Index last = 250;
  constexpr Index slot = 17;
  for (const Kernels& level : runnable_kernels()) {
    LargeVector<float> values(3 * modes_of_part * part_of.size(), 7);
    level.modes.form(entries, data, combination, values.data(), first, last);
    LargeVector<double> sums(n_parts * slots, 1);
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
                          factors[(part * slots + l) * modes_of_part + j];
            }
            if (!is_inside) expected = 7;
            const float found = values[(3 * e + c) * modes_of_part + j];
            REQUIRE(found == doctest::Approx(expected).epsilon(1e-5));
          }
          for (Index l = 0; is_inside && l < most_learned_shapes; ++l) {
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

}  // namespace
}  // namespace dynmesh::testing
