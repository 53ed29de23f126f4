#include <doctest/doctest.h>

#include <cmath>
#include <random>
#include <vector>

#include "detail/anchors.hpp"
#include "detail/constants.hpp"
#include "detail/shape_system.hpp"
#include "meshes.hpp"
#include "support/workers.hpp"

namespace dynmesh::testing {
namespace {

using Field = std::vector<Vector3<double>>;

Field random_field(std::size_t rows, unsigned seed) {
  std::mt19937 random(seed);
  std::normal_distribution<double> normal;
  Field field(rows);
  for (auto& x : field) x = {normal(random), normal(random), normal(random)};
  return field;
}

/// The largest gradient of |K D - r|^2 + sum_i w_i (n_i . (D_i - p_i))^2 at steps D, for three
/// fields, over the largest at 0.
double gradient_after(int steps) {
  const auto mesh = torus(12);
  const std::size_t k = mesh.size();
  Workers workers(1);
  const Topology topology = build_topology(mesh.faces(), k);
  std::vector<Triangle> faces(mesh.faces().count);
  for (std::size_t f = 0; f < faces.size(); ++f) faces[f] = mesh.faces()[f];
  Field frame(k);
  for (std::size_t v = 0; v < k; ++v) {
    frame[v] = {mesh.vertices[3 * v], mesh.vertices[3 * v + 1], mesh.vertices[3 * v + 2]};
  }
  ShapeSystem system(topology.cells, workers);
  system.reset(system.prepare<double>(faces, frame, DetailConstants{}));
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
  Field kd(3 * k);
  system.apply(d, 3, kd);
  Field left(k);
  Field gradient(k);
  double largest = 0;
  double at_start = 0;
  for (const bool is_start : {false, true}) {
    for (std::size_t f = 0; f < 3; ++f) {
      for (std::size_t v = 0; v < k; ++v) {
        left[v] = residual[3 * v + f] - (is_start ? 0.0 : 1.0) * kd[3 * v + f];
      }
      system.apply_transposed(left, gradient);
      for (std::size_t v = 0; v < k; ++v) {
        const auto off = pull[3 * v + f] - (is_start ? 0.0 : 1.0) * d[3 * v + f];
        const auto g = gradient[v] + (anchors.weights[v] * dot(normals[v], off)) * normals[v];
        double& most = is_start ? at_start : largest;
        most = std::max(most, std::sqrt(squared_norm(g)));
      }
    }
  }
  return largest / at_start;
}

TEST_CASE("steps towards planes end where all planes and shapes balance") {
  CHECK(gradient_after(400) < 1e-6);
  CHECK(gradient_after(5) < 0.5);
  CHECK(gradient_after(0) == doctest::Approx(1));
}

}  // namespace
}  // namespace dynmesh::testing
