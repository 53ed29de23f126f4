/// Where a registration begins: rigid motions of the template, and landmarks.
#pragma once

#include <Eigen/Geometry>
#include <dynmesh/types.hpp>
#include <span>
#include <vector>

#include "registration/constants.hpp"
#include "surface_fit/point_scan.hpp"

namespace dynmesh {

/// Vertices of a template, and where they belong.
struct Targets {
  std::vector<Index> vertices;
  std::vector<Vector3> positions;

  void add(Index vertex, const Vector3& position) {
    vertices.push_back(vertex);
    positions.push_back(position);
  }
  /// Whether there are three that are not on a line.
  [[nodiscard]] bool determine_a_rotation() const;
  /// The rigid motion that brings the vertices of `frame` closest to their positions.
  [[nodiscard]] Eigen::Isometry3d motion_from(Field frame) const;
};

/// A rigid motion of the template, and landmarks between which it then bends: those of the caller,
/// and rough ones all over the surface, which tell its pose, but no position exactly.
struct Candidate {
  Eigen::Isometry3d motion = Eigen::Isometry3d::Identity();
  Targets landmarks = {};
  Targets rough = {};
};

/// Candidates for a scan in any pose, the most likely first. Distances along the surface do not
/// change where it bends: the tips of the limbs are paired with those of the scan as these tell, in
/// the most likely ways, and then places of the template with the points whose distances from
/// the tips are most alike. All have the landmarks.
std::vector<Candidate> candidates_by_tips(std::span<const Triangle> faces, Field frame,
                                          const PointScan& scan, const Targets& landmarks);

}  // namespace dynmesh
