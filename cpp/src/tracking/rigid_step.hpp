/// Moves a whole surface, without bending it, to what was measured.
#pragma once

#include <Eigen/Geometry>
#include <dynmesh/types.hpp>
#include <span>

#include "tracking/surface_rows.hpp"

namespace dynmesh {

/// The rotation vector and the translation of x -> x + turn x (x - centre) + shift, to first order.
struct SmallMotion {
  Vector3<double> centre;
  Vector3<double> turn;
  Vector3<double> shift;
};

/// Returns the motion that brings the places of rows on a surface X closest to the planes of their
/// points: point-to-plane ICP (Chen and Medioni 1992), linearised. Motions that the planes hardly
/// determine stay small: `caution` is added to the diagonal, as a share of its mean.
SmallMotion fit_to_planes(std::span<const SurfaceRow> rows, std::span<const Vector3<double>> x,
                          double caution);

/// The proper rotation that its turn stands for.
Eigen::AngleAxisd rotation_of(const SmallMotion& motion);

/// Applies it as a proper rotation, and returns the largest distance that a vertex moved.
double move_by(const SmallMotion& motion, std::span<Vector3<double>> frame);

}  // namespace dynmesh
