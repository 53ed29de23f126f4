/// Whether a template lies where a scan shows it.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <dynmesh/quality.hpp>
#include <dynmesh/types.hpp>
#include <span>
#include <vector>

#include "quality/evidence.hpp"
#include "surface_fit/surface_matcher.hpp"

namespace dynmesh {

/// How a mesh lies in a scan, of which it may be a part.
struct Fit {
  Evidence evidence = {};
  /// The share of what sensors should see that they may miss, where they see it flatly.
  double unseen = 0;
  double left = 1;     ///< the share of the points that are far from the mesh, or face another way
  double stretch = 0;  ///< by which share of their length edges have changed, on average

  /// The share that one has nothing of the other in common with. Of a part and a whole, all of the
  /// part lies on the whole.
  [[nodiscard]] double missing() const {
    return std::min(std::max(1 - evidence.explained - unseen, 0.0), left);
  }
  /// The least of several tells the right pose.
  [[nodiscard]] double misfit() const { return missing() + evidence.contradicted() + stretch; }
};

/// (k,) 1 for vertices at edges that have a single face.
std::vector<std::uint8_t> find_border(std::span<const Triangle> faces, std::size_t k);

/// Of the points beside a surface, on its side and within its outline, the share that is farther
/// from it than their noise. Where they are noisy, they are beside it within two mean edges, since
/// points of no surface scatter as noise does, but as far from it as near to it.
double unexplained_beside(const MatchedPoints& points, std::span<const std::uint8_t> is_border,
                          double noise);

/// The quality of a pose that was measured. What else was scanned says nothing.
Quality quality_of_pose(const Fit& fit, const Measure& measure);

}  // namespace dynmesh
