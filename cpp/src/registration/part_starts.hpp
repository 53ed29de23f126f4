/// Rigid motions that may put one of two surfaces onto a part of the other one.
#pragma once

#include <Eigen/Geometry>
#include <vector>

#include "surface_fit/point_scan.hpp"

namespace dynmesh {

/// The motions that explain most of the points of `part` by those of `whole`, from any rotation and
/// place, the best one first. One place of the part after the other is laid on points all over the
/// whole, as their normals tell, and turned about them; the best motions are improved by iterative
/// closest points. Both have as many points for each area. Equal input gives equal results.
std::vector<Eigen::Isometry3d> part_starts(const PointScan& part, const PointScan& whole);

}  // namespace dynmesh
