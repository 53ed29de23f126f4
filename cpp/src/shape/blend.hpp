/// The blend: how much of the shape of frame 0, and of the recent change of the shape, is added to
/// the shape of the last frame.
#pragma once

#include <cstddef>
#include <dynmesh/types.hpp>
#include <span>
#include <vector>

#include "base/lender.hpp"
#include "base/workers.hpp"
#include "mesh/clusters.hpp"
#include "shape/detail_operator.hpp"
#include "shape/shape_system.hpp"

namespace dynmesh {

/// b is the weight of the shape of frame 0 minus that of the last frame, and c the weight of the
/// recent change.
struct Blend {
  double b = 0;
  double c = 0;
  bool is_b_known = false;  ///< whether r1 is more than rounding errors, so that it tells b

  [[nodiscard]] Vector3 of(const ShapeTerms& terms) const {
    return terms.last + b * terms.to_rest + c * terms.change;
  }
};

/// Residuals at a vertex: r0 with the shape of the last frame, and the residuals r1 and r2 that a
/// unit of b and a unit of c add.
struct Residuals {
  Vector3 r0, r1, r2;
  double weight = 1;
};

/// The residuals of step 2 at all vertices with `counts` 1. All arrays are (k,).
struct ResidualField {
  const Anchors& anchors;
  Field x;                              ///< X before the step
  Field kx;                             ///< K X
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

/// Returns the b and c that minimise |r0 + b r1 + c r2|^2, slightly reduced. b is kept
/// between -0.5 and 1.5, c between 0 and 1.
///
/// b or c is 0 if r1 or r2 is, or if that consists of rounding errors compared with |Q (m_first -
/// m)|^2 or |Q u|^2, or if these are rounding errors themselves. For example, a component with a
/// single anchor can take on any shape, and a subject that stands still has the shape of frame 0;
/// without this check b would be a quotient of rounding errors.
Blend global_blend(const ResidualField& residuals, double mean_edge);

/// Finds the blend of each cluster from the residuals in it and in those beside it, regularised
/// towards the global blend, and interpolates it to the vertices as the rotations are: b_i, (k,),
/// within its bounds. It is the global b if r1 is 0 around the vertex or does not tell the global
/// one. Takes five arrays.
Lent<std::vector<double>> local_blend(const ResidualField& residuals, const Blend& global,
                                      const Clusters& clusters,
                                      Lender<std::vector<double>>& numbers, Workers& workers);

}  // namespace dynmesh
