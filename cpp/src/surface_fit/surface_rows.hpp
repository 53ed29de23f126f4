/// Measured points that a surface is drawn to, each at a place on one of its triangles.
#pragma once

#include <Eigen/Geometry>
#include <Eigen/Sparse>
#include <cstddef>
#include <dynmesh/types.hpp>
#include <span>

#include "base/workers.hpp"
#include "surface_fit/surface_places.hpp"

namespace dynmesh {

/// A term w (n . (sum_s b_s X_s - q))^2 of the energy of positions X, with the place that has the
/// shares b.
struct SurfaceRow : Place {
  Vector3 normal;     ///< n
  Vector3 point;      ///< q
  double weight = 0;  ///< w
};

/// Returns the motion that brings the places of rows on a surface X closest to the planes of their
/// points: point-to-plane ICP (Chen and Medioni 1992), linearised, but with a proper rotation. What
/// the planes hardly determine, as of a sphere, stays small.
Eigen::Isometry3d fit_to_planes(std::span<const SurfaceRow> rows, Field x);

/// The matrix of the energy of rows.
class RowMatrix {
 public:
  RowMatrix(std::span<const SurfaceRow> rows, std::size_t n_vertices);

  /// Adds half of the negative gradient at X, with the `rows` of which this is the matrix.
  void add_forces(std::span<const SurfaceRow> rows, Field x, std::span<Vector3> forces) const;

  /// Adds half of the product of the energy's Hessian with a step: (k,).
  void add_product(Field step, std::span<Vector3> product, Workers& workers) const;

 private:
  using Matrix = Eigen::SparseMatrix<double, Eigen::RowMajor>;

  // (rows, 4 k): sqrt(w) b_s n, for the four numbers in which a field keeps each vertex.
  Matrix matrix_;
  Matrix transposed_;  // of which threads take rows
};

}  // namespace dynmesh
