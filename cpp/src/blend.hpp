/// How much of frame 0's shape there is in a frame, beside that of the last one.
#pragma once

#include <dynmesh/topology.hpp>
#include <dynmesh/types.hpp>
#include <span>
#include <vector>

namespace dynmesh {

/// What one vertex says about b, by the residuals r0, with the shape of the last frame, and r1,
/// what a unit of b adds to it.
struct BlendFit {
  double h = 0;  ///< -r1 . r0
  double q = 0;  ///< |r1|^2

  void add(const Vector3<double>& r0, const Vector3<double>& r1, double weight = 1) {
    h -= weight * (r1.x * r0.x + r1.y * r0.y + r1.z * r0.z);
    q += weight * squared_norm(r1);
  }
};

/// Forgets all residuals if the r1 are rounding errors of zeros, next to the sum `change` of
/// |Q (m_first - m_prev)|^2 that they are left of: a component with one anchor, say, takes on any
/// shape, so that b would be one rounding error over another.
void drop_rounding_errors(std::span<BlendFit> fits, double change);

/// b that makes the sum of |r0 + b r1|^2 smallest, a little short of it; 0 where all r1 are 0.
double global_blend(std::span<const BlendFit> fits);

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
