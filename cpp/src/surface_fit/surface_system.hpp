/// The linear system of a surface that is drawn to measured points while its shape resists.
#pragma once

#include <cstddef>
#include <cstdint>
#include <dynmesh/topology.hpp>
#include <dynmesh/types.hpp>
#include <span>
#include <vector>

#include "base/lender.hpp"
#include "linear/masked_factor.hpp"
#include "mesh/ties.hpp"
#include "shape/detail_operator.hpp"
#include "shape/model.hpp"
#include "surface_fit/coarse_space.hpp"
#include "surface_fit/constants.hpp"
#include "surface_fit/surface_rows.hpp"

namespace dynmesh {

/// A position to which a vertex is drawn.
struct Landmark {
  std::size_t vertex = 0;
  Vector3 target;
  double weight = 0;
};

/// What draws a surface and holds its parts together.
struct Pulls {
  std::span<const SurfaceRow> rows;
  std::span<const Landmark> landmarks;
  std::span<const Tie> ties;
};

/// A = N + mu C + ties + rows + landmarks, and a small weight that holds each vertex where nothing
/// else does. The rows tie the three coordinates together, so A has 3 k unknowns, and is solved by
/// conjugate gradients. Their preconditioner is the factor of N + mu C with the mean weights of the
/// rows at the vertices on the diagonal, which has k, and a coarse space.
class SurfaceSystem {
 public:
  /// `membrane` (k,) is mu. `ties` are all that may have a weight. `model`, `constants` and
  /// `workers` must outlive this object.
  SurfaceSystem(const ShapeModel& model, const std::vector<double>& membrane,
                const TrackingConstants& constants, std::span<const Tie> ties, Workers& workers)
      : SurfaceSystem(model, membrane, normal_matrix(model.k, membrane), constants, ties, workers) {
  }

  [[nodiscard]] std::span<const double> membrane() const { return membrane_; }
  /// The memory of a factor of N + mu C with something on the diagonal, for one at a time.
  [[nodiscard]] Lender<MaskedFactor>& factors() { return factors_; }

  /// The preconditioner for rows whose weights are multiplied by `factor`. It serves for others
  /// with about these weights, until the next one is made.
  [[nodiscard]] Lent<MaskedFactor> preconditioner(const Pulls& pulls, double factor);

  /// forces = K^T W detail. W (k,), the `resistance`, are the weights of the rows of K.
  void pull_back(std::span<const double> resistance, Field detail, std::span<Vector3> forces);

  /// Adds the step D to X for which A D, with K^T W K in the place of N, is the sum of `force`
  /// (k,), which is lost, and of the forces of the rows and landmarks at X.
  void solve(const Pulls& pulls, MaskedFactor& preconditioner, std::span<const double> resistance,
             const SolverLimits& limits, std::span<Vector3> x, std::span<Vector3> force);

 private:
  SurfaceSystem(const ShapeModel& model, const std::vector<double>& membrane,
                const SparseMatrix& normal, const TrackingConstants& constants,
                std::span<const Tie> ties, Workers& workers);
  [[nodiscard]] std::vector<double> held(std::span<const Landmark> landmarks) const;
  void multiply(std::span<const double> resistance, Field x, std::span<Vector3> product);
  void apply_factor(MaskedFactor& factor, Field right_side, std::span<Vector3> x);

  const DetailOperator& operator_;  // K
  std::vector<double> membrane_;    // mu
  const TrackingConstants& constants_;
  Workers& workers_;
  CoarseSpace coarse_;
  Lender<MaskedFactor> factors_;
  std::vector<float> rounded_;   // (k, 4) what is solved for
  std::vector<Vector3> scaled_;  // (k,) the vector that is multiplied by C
};

}  // namespace dynmesh
