/// A force that keeps the triangles of a surface in shape.
#pragma once

#include <array>
#include <cstddef>
#include <dynmesh/types.hpp>
#include <span>
#include <vector>

#include "base/workers.hpp"

namespace dynmesh {

/// The energy mu sum over triangles t and their sides ij of w_tij |(X_i - X_j) - R_t e_tij|^2,
/// where e are the sides in frame 0, R_t rotates the triangle as it is best for its present
/// corners, and w are half of the cotangents of the angles opposite (as-rigid-as-possible, Liu,
/// Zhang, Xu, Gotsman and Gortler 2008). Triangles are those of the intrinsic Delaunay
/// triangulation of frame 0, so the w of an edge add up to its entry in C, the operator of method
/// detail, and mu C, which lies inside of K^T K, is the matrix of the energy while rotations are
/// kept. As each triangle has a rotation of its own, the surface folds without resistance.
///
/// Allocates memory only in the constructor.
class Membrane {
 public:
  /// `mu` (k,) is the weight of the energy, the same in all of a component. `workers` must outlive
  /// this object.
  Membrane(std::span<const Triangle> faces, Field first_frame, double mean_edge,
           std::span<const double> mu, Workers& workers);

  /// Adds half of the negative gradient at X.
  void add_forces(Field x, std::span<Vector3> forces);

 private:
  /// A triangle in frame 0, in its plane: corner 0 at the origin, corner 1 at (x1, 0), and corner 2
  /// at (x2, y2).
  struct Rest {
    std::array<std::size_t, 3> corners;
    std::array<double, 3> weights;  ///< mu w of the side from corner s to corner s + 1
    double x1, x2, y2;
  };
  using Sides = std::array<Vector3, 3>;
  [[nodiscard]] static Sides turned_sides(const Rest& rest, Field x);

  Workers& workers_;
  std::vector<Rest> triangles_;
  std::vector<Sides> forces_;  // of the sides of each triangle
};

}  // namespace dynmesh
