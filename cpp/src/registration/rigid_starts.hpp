/// Rigid motions that may put a template into a scan, from any rotation and position.
#pragma once

#include <Eigen/Geometry>
#include <dynmesh/types.hpp>
#include <span>
#include <vector>

#include "registration/constants.hpp"
#include "tracking/point_scan.hpp"

namespace dynmesh {

/// A motion of the template, and the mean distance of the nearest pairs after it.
struct RigidStart {
  Eigen::Isometry3d motion = Eigen::Isometry3d::Identity();
  double distance = 0;
};

/// The best motions, the best one first, found by iterative closest points (Besl and McKay 1992) in
/// the six dimensions of position and normal, of which the farthest fifth is ignored (trimmed ICP,
/// Chetverikov et al. 2002). Surfaces with symmetries have several. Where the template is in place
/// already, its motion is the first. Equal input gives equal results.
std::vector<RigidStart> rigid_starts(std::span<const Triangle> faces,
                                     std::span<const Vector3<double>> surface,
                                     const PointScan& scan, const RigidStartConstants& constants);

}  // namespace dynmesh
