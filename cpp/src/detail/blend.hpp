/// The blend: how much of the shape of frame 0, and of the recent change of the shape, is added to
/// the shape of the last frame.
#pragma once

#include <cstddef>
#include <dynmesh/topology.hpp>
#include <dynmesh/types.hpp>
#include <span>
#include <vector>

#include "detail/detail_operator.hpp"
#include "detail/shape_system.hpp"
#include "support/geometry.hpp"
#include "support/workers.hpp"

namespace dynmesh {

/// b is the weight of the shape of frame 0 minus that of the last frame, and c the weight of the
/// recent change.
struct Blend {
  double b = 0;
  double c = 0;
};

/// Residuals at a vertex: r0 with the shape of the last frame, and the residuals r1 and r2 that a
/// unit of b and a unit of c add.
struct Residuals {
  Vector3<double> r0, r1, r2;
  double weight = 1;
};

/// The residuals of step 2 at all vertices with `counts` 1. All arrays are (k,).
struct ResidualField {
  const Anchors& anchors;
  std::span<const Vector3<double>> x;   ///< X before the step
  std::span<const Vector3<double>> kx;  ///< K X
  std::span<const ShapeTerms> wanted;   ///< Q m, Q (m_first - m) and Q u
  std::span<const ShapeTerms> steps;    ///< the best steps towards these
  std::span<const ShapeTerms> k_steps;  ///< K times the steps
  double rounding = 0;                  ///< the mean square of rounding errors of a shape

  [[nodiscard]] std::size_t size() const { return x.size(); }

  /// Calls `visit` with the residual of the shape at a vertex after the steps and, for a noisy
  /// anchor, with the residual of its distance from the observed position.
  template <class Visit>
  void visit(std::size_t v, const Visit& visit) const {
    if (anchors.counts[v] == 0) return;
    visit(Residuals{kx[v] + k_steps[v].last - wanted[v].last,
                    k_steps[v].to_rest - wanted[v].to_rest, k_steps[v].change - wanted[v].change});
    if (!anchors.are_noisy()) return;
    visit(Residuals{x[v] + steps[v].last - anchors.observed[v], steps[v].to_rest, steps[v].change,
                    anchors.weights[v]});
  }
};

/// Sums of the products of residuals over all vertices; s01 is the sum of r0 . r1.
struct ResidualSums {
  double s01 = 0, s02 = 0, s11 = 0, s12 = 0, s22 = 0;
  double mean_edges = 0;  ///< the value of s11 if r1 were a mean edge length at every vertex
};

/// Computes the sums. r1 and r2 are replaced by 0 if they are rounding errors compared with |Q
/// (m_first - m)|^2 and |Q u|^2, or if these are rounding errors themselves. For example, a
/// component with a single anchor can take on any shape, and a subject that stands still has the
/// shape of frame 0; without this check b would be a quotient of rounding errors.
ResidualSums sum_products(const ResidualField& residuals, double mean_edge);

/// Returns the b and c that minimise |r0 + b r1 + c r2|^2, slightly reduced, or 0 if the respective
/// residuals are 0. c is between 0 and 1.
Blend global_blend(const ResidualSums& sums);

/// Returns b in the range of local blends.
double bounded_blend(double b);

/// Computes the blend of each vertex from the residuals around it, regularised towards the global
/// blend.
class LocalBlend {
 public:
  /// `workers` must outlive this object. Allocates memory only in the constructor.
  LocalBlend(const Cells& cells, Workers& workers);

  /// Returns b_i, (k,), within its bounds. It is the global b if r1 is 0 around the vertex or s11
  /// is 0.
  std::span<const double> find(const ResidualField& residuals, const ResidualSums& sums,
                               const Blend& global);

 private:
  Workers& workers_;
  DetailOperator smoother_;
  // (k,) of the least-squares fit of b given c: -r1 . (r0 + c r2) in x, and |r1|^2 in y
  std::vector<Vector3<double>> fits_, averaged_;
  std::vector<double> blend_;
};

}  // namespace dynmesh
