#include "tracking/surface_fit.hpp"

#include <cmath>

#include "support/geometry.hpp"

namespace dynmesh {
namespace {

double sum_of_products(std::span<const Vector3<double>> a, std::span<const Vector3<double>> b) {
  double sum = 0;
  for (std::size_t v = 0; v < a.size(); ++v) sum += dot(a[v], b[v]);
  return sum;
}

}  // namespace

SurfaceFit::SurfaceFit(std::size_t n_vertices)
    : residual_(n_vertices),
      preconditioned_(n_vertices),
      direction_(n_vertices),
      product_(n_vertices),
      detail_(n_vertices) {}

void SurfaceFit::take_steps(ShapeSystem& system, Field shape, std::span<const Correspondence> found,
                            int steps, std::span<Vector3<double>> x) {
  const std::size_t k = x.size();
  system.apply(x, 1, detail_);
  for (std::size_t v = 0; v < k; ++v) detail_[v] = shape[v] - detail_[v];
  system.apply_transposed(detail_, residual_);
  for (std::size_t v = 0; v < k; ++v) {
    const Correspondence& c = found[v];
    if (c.weight == 0) continue;
    residual_[v] = residual_[v] + (c.weight * dot(c.normal, c.point - x[v])) * c.normal;
  }
  double size = 0;
  for (int step = 0; step < steps; ++step) {
    system.solve_normal(residual_, preconditioned_);
    const double next_size = sum_of_products(residual_, preconditioned_);
    const double ratio = step == 0 ? 0 : next_size / size;
    size = next_size;
    for (std::size_t v = 0; v < k; ++v) {
      direction_[v] = preconditioned_[v] + ratio * direction_[v];
    }
    system.apply(direction_, 1, detail_);
    system.apply_transposed(detail_, product_);
    for (std::size_t v = 0; v < k; ++v) {
      const Correspondence& c = found[v];
      if (c.weight == 0) continue;
      product_[v] = product_[v] + (c.weight * dot(c.normal, direction_[v])) * c.normal;
    }
    const double curvature = sum_of_products(direction_, product_);
    const double length = size / curvature;
    if (!(curvature > 0) || !std::isfinite(length)) return;
    for (std::size_t v = 0; v < k; ++v) {
      x[v] = x[v] + length * direction_[v];
      residual_[v] = residual_[v] - length * product_[v];
    }
  }
}

}  // namespace dynmesh
