/// Moves the surface to the planes of its correspondences while its shape resists.
#pragma once

#include <dynmesh/types.hpp>
#include <span>
#include <vector>

#include "detail/anchors.hpp"
#include "detail/shape_system.hpp"
#include "tracking/measurement.hpp"

namespace dynmesh {

/// Finds the positions x that minimise |K x - shape|^2 + sum_i w_i (n_i . (q_i - x_i))^2, where q_i
/// and n_i are the measured point and normal of vertex i. The system has 3 k unknowns, since the
/// planes tie the coordinates together, but N + w, which has k, is a good preconditioner, even with
/// the w of another pass: a few steps of conjugate gradients suffice. Allocates memory only in the
/// constructor, and where ShapeSystem does.
class SurfaceFit {
 public:
  using Field = std::span<const Vector3<double>>;

  explicit SurfaceFit(std::size_t n_vertices);

  /// Takes `steps` steps from x (k,), for the vertices that the system was factored for.
  void take_steps(ShapeSystem& system, Field shape, std::span<const Correspondence> found,
                  int steps, std::span<Vector3<double>> x);

 private:
  std::vector<Vector3<double>> residual_, preconditioned_, direction_, product_, detail_;
};

}  // namespace dynmesh
