/// How much of frame 0's shape, and of the change that was under way, there is in a frame, beside
/// the shape of the last one.
#pragma once

#include <cstddef>
#include <dynmesh/topology.hpp>
#include <dynmesh/types.hpp>
#include <span>
#include <vector>

#include "detail/anchors.hpp"
#include "detail/constants.hpp"
#include "support/geometry.hpp"

namespace dynmesh {

/// b, of frame 0's shape less the last one, and c, of the change that was under way.
struct Blend {
  double b = 0;
  double c = 0;
};

/// Residuals at a vertex: r0 with the shape of the last frame, and what a unit of b, r1, and of c,
/// r2, adds to it.
struct Residuals {
  Vector3<double> r0, r1, r2;
  double weight = 1;
};

/// The residuals of step 2 at all vertices that count. Fields of three hold, side by side, what
/// belongs to the shape of the last frame, to a unit of b and to a unit of c.
struct ResidualField {
  const Anchors& anchors;
  std::span<const Vector3<double>> x;        ///< (k,) X before the step
  std::span<const Vector3<double>> kx;       ///< (k,) K X
  std::span<const Vector3<double>> wanted;   ///< (3 k,) Q m, Q (m_first - m) and Q u
  std::span<const Vector3<double>> steps;    ///< (3 k,) the best steps towards them
  std::span<const Vector3<double>> k_steps;  ///< (3 k,) K times these

  [[nodiscard]] std::size_t size() const { return x.size(); }

  /// Calls `visit` with what the steps leave of the shape at a vertex, and of the distance of a
  /// noisy anchor from where it was observed.
  template <class Visit>
  void visit(std::size_t v, const Visit& visit) const {
    if (anchors.counts[v] == 0) return;
    visit(Residuals{kx[v] + k_steps[3 * v] - wanted[3 * v], k_steps[3 * v + 1] - wanted[3 * v + 1],
                    k_steps[3 * v + 2] - wanted[3 * v + 2]});
    if (!anchors.are_noisy()) return;
    visit(Residuals{x[v] + steps[3 * v] - anchors.observed[v], steps[3 * v + 1], steps[3 * v + 2],
                    anchors.weights[v]});
  }
};

/// Sums of the products of residuals over all vertices, by their numbers.
struct ResidualSums {
  double s00 = 0, s01 = 0, s02 = 0, s11 = 0, s12 = 0, s22 = 0;
  double mean_edges = 0;  ///< what s11 would be if r1 were a mean edge at every vertex

  void add(const Residuals& r) {
    s00 += r.weight * dot(r.r0, r.r0);
    s01 += r.weight * dot(r.r0, r.r1);
    s02 += r.weight * dot(r.r0, r.r2);
    s11 += r.weight * dot(r.r1, r.r1);
    s12 += r.weight * dot(r.r1, r.r2);
    s22 += r.weight * dot(r.r2, r.r2);
  }
};

/// The sums, with r1 and r2 taken for 0 where they are rounding errors next to |Q (m_first - m)|^2
/// and |Q u|^2, which they are left of: a component with one anchor, say, takes on any shape, so
/// that b would be one rounding error over another.
ResidualSums sum_products(const ResidualField& residuals, double mean_edge);

/// b and c that make |r0 + b r1 + c r2|^2 smallest, a little short of it; 0 where their residuals
/// are. c is from 0 to 1, and the smaller the less it explains: what was under way may have ended,
/// and is as noisy as the frames that it was seen in.
Blend global_blend(const ResidualSums& sums, const DetailConstants& constants);

/// What one vertex says about b, given c.
struct BlendFit {
  double h = 0;  ///< -r1 . (r0 + c r2)
  double q = 0;  ///< |r1|^2

  void add(const Residuals& r, double c) {
    h -= r.weight * dot(r.r1, r.r0 + c * r.r2);
    q += r.weight * dot(r.r1, r.r1);
  }
};

/// The blend of each vertex by the residuals around it, drawn to the global one.
class LocalBlend {
 public:
  /// Both must outlive this object. Allocates here only.
  LocalBlend(const Cells& cells, const DetailConstants& constants);

  /// b_i, (k,), within its bounds; the global b where r1 is 0 all around, or 0 in `sums`.
  std::span<const double> find(const ResidualField& residuals, const ResidualSums& sums,
                               const Blend& global);

 private:
  const Cells& cells_;
  const DetailConstants& constants_;
  std::vector<double> shares_;  // (k,) one over the size of the cell
  std::vector<BlendFit> fits_;
  std::vector<BlendFit> averaged_;
  std::vector<double> blend_;
};

}  // namespace dynmesh
