#include "shape/blend.hpp"

#include <algorithm>
#include <cmath>

#include "shape/constants.hpp"

namespace dynmesh {

namespace {

/// b in the range of blends.
double bounded_blend(double b) {
  return std::clamp(b, -detail_constants.largest_excess, 1 + detail_constants.largest_excess);
}

}  // namespace

Blend global_blend(const ResidualField& residuals, double mean_edge) {
  // If the sum of |r1|^2 is below this fraction of |Q (m_first - m)|^2, r1 consists of rounding
  // errors. The same applies to r2 and |Q u|^2. It is the square of 1e-9, the relative error of a
  // solution in double precision.
  constexpr double rounding = 1e-18;
  double s01 = 0, s02 = 0, s11 = 0, s12 = 0, s22 = 0;  // s01 is the sum of r0 . r1
  double shape = 0;
  double change = 0;
  double counted = 0;
  for (std::size_t v = 0; v < residuals.size(); ++v) {
    residuals.visit(v, [&](const Residuals& r) {
      s01 += r.weight * dot(r.r0, r.r1);
      s02 += r.weight * dot(r.r0, r.r2);
      s11 += r.weight * dot(r.r1, r.r1);
      s12 += r.weight * dot(r.r1, r.r2);
      s22 += r.weight * dot(r.r2, r.r2);
    });
    shape += residuals.anchors.counts[v] * squared_norm(residuals.wanted[v].to_rest);
    change += residuals.anchors.counts[v] * squared_norm(residuals.wanted[v].change);
    counted += residuals.anchors.counts[v];
  }
  const double nothing = counted * residuals.rounding;
  if (shape <= nothing || s11 <= rounding * shape) s01 = s11 = s12 = 0;
  if (change <= nothing || s22 <= rounding * change) s02 = s12 = s22 = 0;

  const double caution = detail_constants.caution;
  const double mean_edges = counted * mean_edge * mean_edge;
  const double cautious_s11 = std::min(caution * s11, s11 + (caution - 1) * mean_edges);
  const auto finite = [](double value) { return std::isfinite(value) ? value : 0; };
  // Remove from r0 and r2 what b can explain.
  const double b_of_r2 = finite(s12 / cautious_s11);
  const double h = -(s02 - b_of_r2 * s01);
  const double q = detail_constants.caution_of_change * s22 - b_of_r2 * s12;
  const double c = std::clamp(finite(h / q), 0.0, 1.0);
  return {bounded_blend(finite(-(s01 + c * s12) / cautious_s11)), c, s11 != 0};
}

// h_c and q_c, the least-squares fit of b given c, are -r1 . (r0 + c r2) and |r1|^2.
Lent<std::vector<double>> local_blend(const ResidualField& residuals, const Blend& global,
                                      const Clusters& clusters,
                                      Lender<std::vector<double>>& numbers, Workers& workers) {
  auto h = numbers.lend();
  auto q = numbers.lend();
  const auto add_residuals = [&](std::size_t c) {
    h[c] = q[c] = 0;
    if (!global.is_b_known) return;
    for (const Index v : clusters.members[c]) {
      residuals.visit(at(v), [&](const Residuals& r) {
        h[c] -= r.weight * dot(r.r1, r.r0 + global.c * r.r2);
        q[c] += r.weight * dot(r.r1, r.r1);
      });
    }
  };
  workers.for_each_in_chunks(clusters.size(), add_residuals, Clusters::typical_size);
  auto h_around = numbers.lend();
  auto q_around = numbers.lend();
  double sum = 0;
  for (std::size_t c = 0; c < clusters.size(); ++c) {
    h_around[c] = h[c];
    q_around[c] = q[c];
    for (const Index other : clusters.neighbours[c]) {
      h_around[c] += h[other];
      q_around[c] += q[other];
    }
    sum += q_around[c];
  }
  const double eta = detail_constants.pull * sum / static_cast<double>(clusters.size());
  auto& of_clusters = h;
  for (std::size_t c = 0; c < clusters.size(); ++c) {
    const double blend = (h_around[c] + eta * global.b) / (q_around[c] + eta);
    of_clusters[c] = bounded_blend(std::isfinite(blend) ? blend : global.b);
  }
  auto of_vertices = numbers.lend();
  workers.for_each_in_chunks(of_vertices.size(), [&](std::size_t v) {
    of_vertices[v] = 0;
    for (Clusters::Weights::InnerIterator e(clusters.weights, static_cast<Index>(v)); e; ++e) {
      of_vertices[v] += e.value() * of_clusters[e.col()];
    }
  });
  return of_vertices;
}

}  // namespace dynmesh
