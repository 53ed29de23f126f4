/// Moves a whole surface, without bending it, to what was measured.
#pragma once

#include <Eigen/Geometry>
#include <dynmesh/types.hpp>
#include <span>

#include "tracking/surface_rows.hpp"

namespace dynmesh {

/// Returns the motion that brings the places of rows on a surface X closest to the planes of their
/// points: point-to-plane ICP (Chen and Medioni 1992), linearised, but with a proper rotation. What
/// the planes hardly determine, as of a sphere, stays small.
Eigen::Isometry3d fit_to_planes(std::span<const SurfaceRow> rows,
                                std::span<const Vector3<double>> x);

/// Moves a frame, and returns the largest distance that a vertex moved.
double move_by(const Eigen::Isometry3d& motion, std::span<Vector3<double>> frame);

}  // namespace dynmesh
