/// What speaks for a surface in a scan, and what against it.
#pragma once

#include "quality/coverage.hpp"
#include "quality/sight.hpp"
#include "surface_fit/surface_matcher.hpp"

namespace dynmesh {

/// What the points of a scan are worth, beside the surface that they are matched with.
struct PointQuality {
  /// The standard deviation of their distances along the normals of the surface. It follows from
  /// the differences of those at the same vertex, so that a surface that lies beside the points is
  /// no noise. 0 if hardly any vertex has several points.
  double noise = 0;
  /// Whether the normals of neighbours agree, so that they tell the side of a surface. Noise of
  /// the size of the distances between points leaves none.
  bool has_normals = false;
};

PointQuality quality_of(const BentSurface& surface, const MatchedPoints& points);

/// Shares are of areas of the bent surface unless they are of points.
struct Evidence {
  double seen = 0;  ///< of the surface, what should be seen of it
  /// Of this, what has a point within the noise; if most points on the surface lie elsewhere, where
  /// sensors see it too flatly, of the points that are not of other things, those on it.
  double explained = 0;
  double hole = 0;  ///< of the surface, the largest connected piece that is not explained
  /// Of what should be seen, what lies before measured points, on the same line of sight, and has
  /// none itself.
  double seen_through = 0;
  double wrong_side = 0;  ///< of the points on the surface, those that face the other way
  PointQuality points;
  double others = 0;           ///< of all points, those that lie on nothing of the surface
  double others_distance = 0;  ///< the median distance from it to them

  [[nodiscard]] double contradicted() const { return seen_through + wrong_side; }
};

/// `points` have their nearest places on the surface, after `update_distances`.
Evidence evidence_of(const BentSurface& surface, const MatchedPoints& points,
                     const SightSettings& settings, Workers& workers);

}  // namespace dynmesh
