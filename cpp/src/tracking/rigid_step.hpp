/// Moves a whole surface, without bending it, to what was measured.
#pragma once

#include <Eigen/Geometry>
#include <dynmesh/types.hpp>
#include <span>

#include "tracking/constants.hpp"
#include "tracking/correspondences.hpp"
#include "tracking/measurement.hpp"

namespace dynmesh {

/// The rotation vector and the translation of x -> x + turn x (x - centre) + shift, to first order.
struct SmallMotion {
  Vector3<double> centre;
  Vector3<double> turn;
  Vector3<double> shift;
};

/// Returns the motion that brings the positions of the vertices closest to the planes of their
/// correspondences: point-to-plane ICP (Chen and Medioni 1992), linearised. Motions that the planes
/// hardly determine stay small: `caution` is added to the diagonal, as a share of its mean.
SmallMotion fit_to_planes(std::span<const Vector3<double>> frame,
                          std::span<const Correspondence> found, double caution);

/// The proper rotation that its turn stands for.
Eigen::AngleAxisd rotation_of(const SmallMotion& motion);

/// Applies it as a proper rotation.
void move_rigidly(const SmallMotion& motion, std::span<Vector3<double>> frame);

/// Moves X as a whole to the points that a search finds, unless there are too few.
void rigid_step(Correspondences& correspondences, const Search& search,
                const TrackingConstants& constants, std::span<Vector3<double>> x);

/// A search for a rigid motion. It has six unknowns, so some of the vertices are enough. `radius`
/// and `scale` are in mean edges.
Search rigid_search(double radius, double scale, std::size_t n_vertices,
                    const TrackingConstants& constants);

}  // namespace dynmesh
