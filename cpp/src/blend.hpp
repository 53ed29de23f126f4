/// How much of frame 0's shape there is in a frame, beside that of the last one.
#pragma once

#include <dynmesh/topology.hpp>
#include <dynmesh/types.hpp>
#include <span>
#include <vector>

namespace dynmesh {

/// Residuals of a frame, two for each vertex: r0 with the shape of the last frame, and r1, what a
/// unit of b adds to it.
using Residuals = std::span<const Vector3<double>>;

/// b that makes |r0 + b r1| smallest, a little short of it; 0 where r1 is 0.
double global_blend(Residuals residuals);

/// The blend of each vertex by the residuals around it, drawn to the global one.
class LocalBlend {
 public:
  /// `cells` must outlive this object. Allocates here only.
  explicit LocalBlend(const Cells& cells);

  /// (k,) from -0.5 to 1.5; `global` where r1 is 0.
  std::span<const double> find(Residuals residuals, double global);

 private:
  /// h_i = -r1_i . r0_i and q_i = |r1_i|^2.
  struct Fit {
    double h;
    double q;
  };

  const Cells& cells_;
  std::vector<double> shares_;  // (k,) one over the size of the cell
  std::vector<Fit> fits_;
  std::vector<Fit> averaged_;
  std::vector<double> blend_;
};

}  // namespace dynmesh
