/// Components whose points lie elsewhere than where they were expected.
#pragma once

#include <Eigen/Geometry>
#include <dynmesh/types.hpp>
#include <optional>
#include <vector>

#include "surface_fit/constants.hpp"

namespace dynmesh {

/// Points with normals of unit length, or of 0 where that is not known.
struct OrientedPoints {
  std::vector<Vector3> points;
  std::vector<Vector3> normals;
};

/// Seeks a component among points that nothing explains. `part` is what sensors should see of it,
/// where it was expected. It is put at each cluster of points of about its size, the nearest first,
/// and moved rigidly to the points there (Chen and Medioni 1992). Returns the motion to where most
/// of it has points, or nothing, and then erases these points. The time is that of some hundred
/// searches for each cluster.
std::optional<Eigen::Isometry3d> found_among(const OrientedPoints& part,
                                             OrientedPoints& unexplained, double mean_edge,
                                             const TrackingConstants& constants);

}  // namespace dynmesh
