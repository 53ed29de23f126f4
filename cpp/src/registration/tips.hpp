/// The tips of limbs, which tell large motions where the nearest points do not.
#pragma once

#include <cstddef>
#include <dynmesh/types.hpp>
#include <span>
#include <utility>
#include <vector>

#include "registration/constants.hpp"
#include "tracking/point_scan.hpp"

namespace dynmesh {

/// Points of a surface that are farthest from each other along it.
struct Tips {
  std::vector<std::size_t> numbers;  ///< of the points
  /// The distances of all points from each tip, in shares of the longest one; infinite where there
  /// is no way along the surface.
  std::vector<std::vector<double>> from;
};

/// At most `n_tips`; fewer if the surface has no more. Near points count as connected, unless their
/// normals are opposed. Only the largest connected part is considered.
Tips tips_of(const PointScan& scan, std::size_t n_tips, const TipConstants& constants);

/// In `likely_pairs`, a tip that has no other: that of a limb which touches another one.
constexpr std::size_t no_tip = static_cast<std::size_t>(-1);

/// Which tip of the second surface each tip of the first one may be, the most likely first: those
/// whose distances from each other are alike. At first those in which each has
/// another, and then those in which one has none.
std::vector<std::vector<std::size_t>> likely_pairs(const Tips& first, const Tips& second,
                                                   const TipConstants& constants);

}  // namespace dynmesh
