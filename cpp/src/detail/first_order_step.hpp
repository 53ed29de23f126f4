/// The step of first order: it keeps the edges of the last frame, as far as rotations can.
#pragma once

#include <cstdint>
#include <dynmesh/types.hpp>
#include <span>
#include <vector>

#include "detail/constants.hpp"
#include "detail/detail_operator.hpp"
#include "factor/masked_factor.hpp"
#include "kernels/kernels.hpp"
#include "support/workers.hpp"

namespace dynmesh {

/// One iteration of as-rigid-as-possible deformation (Sorkine and Alexa 2007) of the last frame G.
/// R_i is the rotation that best maps the edges of vertex i in G to those in X. The free vertices
/// then minimise sum_ij w_ij |X_i - X_j - (R_i + R_j) (G_i - G_j) / 2|^2 with all others fixed. The
/// edges and the weights w are those of C, so the result does not depend on the scale of the mesh.
///
/// Allocates memory only in the constructor.
class FirstOrderStep {
 public:
  using Field = std::span<const Vector3<double>>;

  /// For a sequence whose frame 0 has the operator `k`. `workers` must outlive this object.
  FirstOrderStep(const DetailOperator& k, const FirstOrderConstants& constants, Workers& workers);

  /// Returns the step (k,) from the positions X, 0 where `is_free` is 0. Every component with free
  /// vertices must have others, too. The result is in `scratch`, (2 k,) or longer.
  std::span<Vector3<double>> find(Field positions, Field last,
                                  std::span<const std::uint8_t> is_free,
                                  std::span<Vector3<double>> scratch);

 private:
  void fit_rotations(Field positions, Field last);
  [[nodiscard]] Vector3<double> residual(std::size_t v, Field positions) const;

  Workers& workers_;
  DetailOperator laplacian_;  // L = diag(sum_j w_ij) - W; its scale is 1
  MaskedFactor factor_;
  std::vector<Vector3<double>> edges_;
  std::vector<Covariance> covariances_;
  std::vector<Quaternion> quaternions_;
};

}  // namespace dynmesh
