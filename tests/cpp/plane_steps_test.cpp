#include <doctest/doctest.h>

#include <cmath>
#include <vector>

#include "detail/anchors.hpp"
#include "detail/constants.hpp"
#include "detail/shape_system.hpp"
#include "meshes.hpp"
#include "support/workers.hpp"

namespace dynmesh::testing {
namespace {

using Field = std::vector<Vector3<double>>;

/// The slope of |K D - r|^2 + sum_i w_i (n_i . (D_i - p_i))^2 at steps D, for three fields and in
/// random directions, over that at 0.
double slope_after(int steps) {
  const auto mesh = torus(12);
  const std::size_t k = mesh.size();
  Workers workers(1);
  const Topology topology = build_topology(mesh.faces(), k);
  ShapeSystem system(topology.cells, workers);
  system.reset(system.prepare(triangles_of(mesh), rows_of(mesh.vertices), DetailConstants{}));
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
  // Differences of a quadratic function are its slope exactly.
  double slope = 0;
  double slope_at_start = 0;
  for (unsigned seed = 4; seed < 8; ++seed) {
    const Field direction = random_field(3 * k, seed);
    Field ahead(3 * k), behind(3 * k);
    for (const bool is_start : {false, true}) {
      for (std::size_t i = 0; i < 3 * k; ++i) {
        const auto from = is_start ? Vector3<double>{} : d[i];
        ahead[i] = from + direction[i];
        behind[i] = from - direction[i];
      }
      (is_start ? slope_at_start : slope) += std::abs(energy(ahead) - energy(behind));
    }
  }
  return slope / slope_at_start;
}

TEST_CASE("steps towards planes end where all planes and shapes balance") {
  CHECK(slope_after(400) < 1e-6);
  CHECK(slope_after(5) < 0.5);
  CHECK(slope_after(0) == doctest::Approx(1));
}

}  // namespace
}  // namespace dynmesh::testing
