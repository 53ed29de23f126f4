/// The landmarks with which a template is registered.
#pragma once

#include <Eigen/Geometry>
#include <cstddef>
#include <dynmesh/registration.hpp>
#include <dynmesh/types.hpp>
#include <span>
#include <vector>

#include "tracking/point_scan.hpp"

namespace dynmesh {

/// Throws std::invalid_argument if the landmarks of a caller contradict each other, or are not of a
/// template with this many vertices.
template <class Real>
void check_landmarks(const Landmarks<Real>& landmarks, std::size_t n_vertices);

/// Throws std::invalid_argument if a position is farther outside the box around a scan than a
/// template of this size can reach, as in another unit or in other axes. The time is linear in the
/// number of points.
void check_places(std::span<const Vector3<double>> positions, const PointScan& scan, double size);

/// How the landmarks of a caller are used: by internal vertices, in double precision.
struct Targets {
  std::vector<Index> vertices;
  std::vector<Vector3<double>> positions;

  /// Whether there are three that are not on a line.
  [[nodiscard]] bool determine_a_rotation() const;
  /// The rigid motion that brings the vertices of `frame` closest to their positions.
  [[nodiscard]] Eigen::Isometry3d motion_from(std::span<const Vector3<double>> frame) const;
};

}  // namespace dynmesh
