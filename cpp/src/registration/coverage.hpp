/// Which part of a surface was measured.
#pragma once

#include <dynmesh/topology.hpp>
#include <dynmesh/types.hpp>
#include <span>

#include "mesh/triangle.hpp"
#include "registration/constants.hpp"
#include "registration/visibility.hpp"
#include "tracking/point_scan.hpp"

namespace dynmesh {

/// A surface (k,) with unit normals at its vertices, on the side that the sensors see, what they
/// should see of it, and the template from which it was bent.
struct SeenSurface {
  std::span<const Triangle> faces;
  const Cells& cells;
  std::span<const Vector3<double>> first_frame;
  std::span<const Vector3<double>> x;
  std::span<const Vector3<double>> normals;
  std::span<const Sight> seen;
  double mean_edge = 1;
};

struct Coverage {
  /// The share of the vertices whose front the sensors should see and that have no point: none
  /// within the distance at which a vertex counts as observed or, where points are sparse, within
  /// some mean distances between them. 1 if the sensors should see none.
  double empty_share = 1;
  /// The share of the template's area that is the largest connected piece without a point, of what
  /// the sensors should see: a limb that was not measured, and may lie anywhere. Its vertices have
  /// no point within 1.5 times the distance of `empty_share` (`hole_distance`).
  double hole = 1;
  /// The share of the template's area where another part lies as well and faces the same way. No
  /// surface does: something that was not measured was drawn to the points of something else.
  double overlap = 0;
  /// The share of the edges that have another length than in the template, and of those without any
  /// point near them, seen or hidden: they join what does not belong together, such as exchanged
  /// legs.
  double stretched = 0;
  double bridging = 0;
  /// How much more the edges without any point near them are stretched or shortened than the
  /// others, on average, times their share. Nothing that was measured stretches these.
  double bridging_excess = 0;

  [[nodiscard]] bool has_bridges(const RegistrationConstants& constants) const {
    // In a bent pose, measured edges are stretched as well; the others are suspicious only if they
    // are stretched more.
    return (bridging > constants.doubtful_bridging && bridging_excess > 0) ||
           bridging_excess > constants.doubtful_bridging_excess;
  }
};

Coverage coverage_of(const SeenSurface& surface, const PointScan& scan,
                     const TrackingConstants& tracking, const RegistrationConstants& constants);

}  // namespace dynmesh
