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

LocalBlend::LocalBlend(const Clusters& clusters, Workers& workers)
    : clusters_(clusters),
      workers_(workers),
      fits_(clusters.size()),
      around_(clusters.size()),
      of_clusters_(clusters.size()),
      blend_(clusters.of_vertex.size()) {}

std::span<const double> LocalBlend::find(const ResidualField& residuals, const Blend& global) {
  const auto add_residuals = [&](std::size_t c) {
    Fit& fit = fits_[c] = {};
    if (!global.is_b_known) return;
    for (const Index v : clusters_.members[c]) {
      residuals.visit(at(v), [&](const Residuals& r) {
        fit.h -= r.weight * dot(r.r1, r.r0 + global.c * r.r2);
        fit.q += r.weight * dot(r.r1, r.r1);
      });
    }
  };
  workers_.for_each_in_chunks(clusters_.size(), add_residuals, Clusters::typical_size);
  double sum = 0;
  for (std::size_t c = 0; c < clusters_.size(); ++c) {
    around_[c] = fits_[c];
    for (const Index other : clusters_.neighbours[c]) {
      around_[c].h += fits_[other].h;
      around_[c].q += fits_[other].q;
    }
    sum += around_[c].q;
  }
  const double eta = detail_constants.pull * sum / static_cast<double>(clusters_.size());
  for (std::size_t c = 0; c < clusters_.size(); ++c) {
    const double blend = (around_[c].h + eta * global.b) / (around_[c].q + eta);
    of_clusters_[c] = bounded_blend(std::isfinite(blend) ? blend : global.b);
  }
  workers_.for_each_in_chunks(blend_.size(), [&](std::size_t v) {
    blend_[v] = 0;
    for (Clusters::Weights::InnerIterator e(clusters_.weights, static_cast<Index>(v)); e; ++e) {
      blend_[v] += e.value() * of_clusters_[e.col()];
    }
  });
  return blend_;
}

}  // namespace dynmesh
