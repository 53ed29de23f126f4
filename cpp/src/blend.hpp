/// How much of frame 0's shape, and of the change that was under way, there is in a frame, beside
/// the shape of the last one.
#pragma once

#include <dynmesh/topology.hpp>
#include <dynmesh/types.hpp>
#include <span>
#include <vector>

#include "geometry.hpp"

namespace dynmesh {

/// b, of frame 0's shape less the last one, and c, of the change that was under way.
struct Blend {
  double b = 0;
  double c = 0;
};

/// Residuals: r0 with the shape of the last frame, and what a unit of b, r1, and of c, r2, adds to
/// it.
struct Residuals {
  Vector3<double> r0, r1, r2;
  double weight = 1;
};

/// Sums of the products of residuals, by their numbers.
struct ResidualSums {
  double s00 = 0, s01 = 0, s02 = 0, s11 = 0, s12 = 0, s22 = 0;

  void add(const Residuals& r) {
    s00 += r.weight * dot(r.r0, r.r0);
    s01 += r.weight * dot(r.r0, r.r1);
    s02 += r.weight * dot(r.r0, r.r2);
    s11 += r.weight * dot(r.r1, r.r1);
    s12 += r.weight * dot(r.r1, r.r2);
    s22 += r.weight * dot(r.r2, r.r2);
  }

  /// Takes r1 and r2 for 0 where they are rounding errors of that, next to the sums `shape` and
  /// `change` of |Q (m_first - m_prev)|^2 and |Q u|^2 that they are left of: a component with one
  /// anchor, say, takes on any shape, so that b would be one rounding error over another.
  void drop_rounding_errors(double shape, double change);
};

/// b and c that make |r0 + b r1 + c r2|^2 smallest, a little short of it; 0 where their residuals
/// are. c is from 0 to 1, and the smaller the less it explains: what was under way may have ended,
/// and is as noisy as the frames that it was seen in. `mean_edges`: what the sum of |r1|^2 would be
/// if it were a mean edge at every vertex.
Blend global_blend(const ResidualSums& sums, double mean_edges);

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
  /// `cells` must outlive this object. Allocates here only.
  explicit LocalBlend(const Cells& cells);

  /// (k,) from -0.5 to 1.5; `global` where r1 is 0 all around.
  std::span<const double> find(std::span<const BlendFit> fits, double global);

 private:
  const Cells& cells_;
  std::vector<double> shares_;  // (k,) one over the size of the cell
  std::vector<BlendFit> fits_;
  std::vector<BlendFit> averaged_;
  std::vector<double> blend_;
};

}  // namespace dynmesh
