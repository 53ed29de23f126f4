/// How the iterations on a template correct where it follows its coarse mesh.
#pragma once

#include <dynmesh/types.hpp>
#include <span>
#include <vector>

#include "base/workers.hpp"
#include "shape/memory.hpp"
#include "surface_fit/constants.hpp"

namespace dynmesh {

/// Along the surface, the iterations on the template do not arrive: points say nothing there, only
/// the shape draws it, slowly, and what is left of a motion is left in the next frame as well. So
/// they begin with a share of how far they led in the last frame, and go beyond where they lead
/// (heavy ball, Polyak 1964; successive over-relaxation, Young 1954). The share grows while they
/// lead on in the same direction. Noise of points leads back, and it shrinks to 0.
class Correction {
 public:
  /// `followed` (k,) is where the template follows its coarse mesh, with the rotations `q`.
  Correction(Field followed, std::span<const Quaternion> q, const TrackingMemory& last,
             const TrackingConstants& constants, Workers& workers);

  /// (k,) where the iterations begin.
  [[nodiscard]] std::vector<Vector3> start() const;
  /// Lets X (k,), to which they led, go on along the surface with these normals. `next` then holds
  /// how far that is from where the template followed, turned back by `q`, those of X.
  void end(Field normals, std::span<const Quaternion> q, std::span<Vector3> x,
           TrackingMemory& next) const;

 private:
  std::vector<Vector3> followed_;
  std::vector<Vector3> last_;  // the correction of the last frame, turned by q
  double share_;
  const TrackingConstants& constants_;
  Workers& workers_;
};

/// Lets the next iterations begin where the template follows.
void forget_correction(TrackingMemory& memory);

}  // namespace dynmesh
