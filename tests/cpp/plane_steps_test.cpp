#include <doctest/doctest.h>

#include <cmath>
#include <vector>

#include "detail/anchors.hpp"
#include "detail/constants.hpp"
#include "detail/shape_system.hpp"
#include "meshes.hpp"
#include "support/workers.hpp"
#include "tracking/surface_system.hpp"

namespace dynmesh::testing {
namespace {

using Field = std::vector<Vector3<double>>;

/// The slope of a quadratic function in random directions, which differences show exactly, over
/// that at 0.
template <class Energy>
double slope_at(const Field& x, const Energy& energy) {
  const auto slope = [&](const Field& from) {
    double sum = 0;
    for (unsigned seed = 4; seed < 8; ++seed) {
      const Field direction = random_field(x.size(), seed);
      Field ahead = from, behind = from;
      for (std::size_t i = 0; i < x.size(); ++i) {
        ahead[i] = from[i] + direction[i];
        behind[i] = from[i] - direction[i];
      }
      sum += std::abs(energy(ahead) - energy(behind));
    }
    return sum;
  };
  return slope(x) / slope(Field(x.size()));
}

/// The slope of |K D - r|^2 + sum_i w_i (n_i . (D_i - p_i))^2 at steps D, for three fields.
double slope_after(int steps) {
  const auto mesh = torus(12);
  const std::size_t k = mesh.size();
  Workers workers(1);
  const Topology topology = build_topology(mesh.faces(), k);
  ShapeSystem system(triangles_of(mesh), topology.cells, workers, rows_of(mesh.vertices),
                     DetailConstants{});
  system.take_planes(steps);
  Field normals = random_field(k, 1);
  for (auto& n : normals) n = (1 / std::sqrt(squared_norm(n))) * n;
  const Field residual = random_field(3 * k, 2);
  const Field pull = random_field(3 * k, 3);
  Anchors anchors(k, true);
  for (std::size_t v = 0; v < k; ++v) {
    anchors.is_solved[v] = 1;
    anchors.counts[v] = 1;
    anchors.weights[v] = v % 3 == 0 ? 0 : 0.5;
  }
  anchors.n_solved = k;
  anchors.normals = normals;
  system.factorize(anchors);
  const auto found =
      system.solve<3, 3>([&](std::size_t v, std::size_t f) { return residual[3 * v + f]; },
                         [&](std::size_t v, std::size_t f) { return pull[3 * v + f]; }, anchors);
  const Field d(found.begin(), found.end());
  const auto energy = [&](const Field& x) {
    Field detail(3 * k);
    system.apply(x, 3, detail);
    double sum = 0;
    for (std::size_t i = 0; i < 3 * k; ++i) {
      const double off = dot(normals[i / 3], x[i] - pull[i]);
      sum += squared_norm(detail[i] - residual[i]) + anchors.weights[i / 3] * off * off;
    }
    return sum;
  };
  return slope_at(d, energy);
}

/// The slope of |K D - r|^2 + mu D C D + sum_p w_p (n_p . (sum_s b_s D_s - q_p))^2 + sum of w |D_i
/// - D_j|^2 over a tie, and of a landmark, at the steps D towards rows.
double slope_of_rows_after(int steps) {
  const auto mesh = torus(12);
  const std::size_t k = mesh.size();
  Workers workers(1);
  const Topology topology = build_topology(mesh.faces(), k);
  const Field first = rows_of(mesh.vertices);
  ShapeSystem shape(triangles_of(mesh), topology.cells, workers, first, DetailConstants{},
                    std::vector<double>(k, 0.0));
  TrackingConstants constants;
  constants.steps = steps;
  constants.settled = 0;
  const std::vector<Tie> ties = {{3, 100, 2.0}};
  const std::vector<Landmark> landmarks = {{7, {1, 2, 3}, 0.4}};
  SurfaceSystem system(shape, topology.cells, workers, constants, ties, first,
                       cluster_vertices(topology.cells, first));
  SurfaceRows rows;
  const Field normals = random_field(2 * k, 1);
  const Field points = random_field(2 * k, 2);
  for (std::uint32_t r = 0; r < 2 * k; ++r) {
    const auto a = r % static_cast<std::uint32_t>(k);
    rows.rows.push_back({{a, (a + 1) % 144, (a + 12) % 144},
                         {0.5, 0.2, 0.3},
                         (1 / std::sqrt(squared_norm(normals[r]))) * normals[r],
                         points[r],
                         0.7});
  }
  rows.index(k);
  const Field residual = random_field(k, 3);
  system.factorize(rows, landmarks, 1);
  Field force(k);
  shape.apply_transposed(residual, force);
  const auto found = system.solve(rows, landmarks, Field(k), force);
  const Field d(found.begin(), found.end());
  const auto energy = [&](const Field& x) {
    Field detail(k);
    shape.apply(x, 1, detail);
    double sum = 2.0 * squared_norm(x[3] - x[100]);
    sum += 0.4 * squared_norm(x[7] - landmarks[0].target);
    for (std::size_t v = 0; v < k; ++v) {
      sum += squared_norm(detail[v] - residual[v]) + constants.hold * squared_norm(x[v]);
    }
    for (const SurfaceRow& row : rows.rows) {
      const double off = dot(row.normal, row.on(x) - row.point);
      sum += row.weight * off * off;
    }
    return sum;
  };
  return slope_at(d, energy);
}

TEST_CASE("steps towards rows end where all rows, ties and shapes balance") {
  CHECK(slope_of_rows_after(400) < 1e-5);  // the rows are rounded to single precision
  CHECK(slope_of_rows_after(12) < 0.02);
  CHECK(slope_of_rows_after(0) == doctest::Approx(1));
}

TEST_CASE("steps towards planes end where all planes and shapes balance") {
  CHECK(slope_after(400) < 1e-6);
  CHECK(slope_after(5) < 0.5);
  CHECK(slope_after(0) == doctest::Approx(1));
}

}  // namespace
}  // namespace dynmesh::testing
