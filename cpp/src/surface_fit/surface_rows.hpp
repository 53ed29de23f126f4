/// Measured points that a surface is drawn to, each at a place on one of its triangles.
#pragma once

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cstddef>
#include <cstdint>
#include <dynmesh/types.hpp>
#include <limits>
#include <span>
#include <vector>

#include "base/rigid_motion.hpp"
#include "base/workers.hpp"
#include "surface_fit/surface_places.hpp"

namespace dynmesh {

constexpr std::size_t no_point = std::numeric_limits<std::size_t>::max();

/// A term w (n . (sum_s b_s X_s - q))^2 of the energy of positions X, with the place that has the
/// shares b.
struct SurfaceRow : Place {
  Vector3 normal;                 ///< n
  Vector3 point;                  ///< q
  double weight = 0;              ///< w
  std::size_t number = no_point;  ///< of its point in MatchedPoints
  bool is_along = false;  ///< whether n lies along the surface, since colours tell the place
};

/// The linearised rigid motion that brings the places of rows on a surface X closest to the planes
/// of their points: point-to-plane ICP (Chen and Medioni 1992). What the planes hardly determine,
/// as of a sphere, stays small. The unknowns are a rotation vector times `reach`, and a shift.
struct PlaneMotion {
  using Matrix = Eigen::Matrix<double, 6, 6>;
  using Vector = Eigen::Matrix<double, 6, 1>;

  /// Sums up rows on X.
  PlaneMotion(std::span<const SurfaceRow> rows, Field x);
  /// The sums of no row, for a surface with these positions. `reach_of_one` is the reach of a
  /// single vertex.
  PlaneMotion(Field positions, double reach_of_one);

  /// The rigid motion for a solution, with a proper rotation.
  [[nodiscard]] Eigen::Isometry3d motion(const Vector& solution) const;

  double weight = 0;  ///< the sum of the weights of the rows
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();
  double reach = 1;  ///< the root mean square distance from the centre
  Matrix normal = Matrix::Zero();
  Vector right = Vector::Zero();
};

/// The rigid motion that brings X closest to the planes of rows; the identity if they determine
/// none.
Eigen::Isometry3d fit_to_planes(std::span<const SurfaceRow> rows, Field x);

/// Moves each vertex v by `motion_of(v)`. Returns the square of the largest distance.
template <class MotionOf>
double move(std::span<Vector3> x, const MotionOf& motion_of) {
  double largest = 0;
  for (std::size_t v = 0; v < x.size(); ++v) {
    const Eigen::Vector3d moved = motion_of(v) * to_eigen(x[v]);
    largest = std::max(largest, (moved - to_eigen(x[v])).squaredNorm());
    x[v] = from_eigen(moved);
  }
  return largest;
}

/// Half of the Hessian of the energy of rows, and of its negative gradient. The sums at a vertex
/// are those of its rows in their order, whichever thread takes them.
class RowProduct {
 public:
  /// For (k,) positions. The rows must outlive this object.
  RowProduct(std::span<const SurfaceRow> rows, std::size_t k, Workers& workers);

  /// Adds the product with a step: (k,).
  void add(Field step, std::span<Vector3> product);
  /// Adds the forces at X: (k,).
  void add_forces(Field x, std::span<Vector3> forces);

 private:
  void add_along(std::span<Vector3> sums);

  // In single precision: all of them are loaded in each step of conjugate gradients, which takes
  // most of its time, and few steps need no more.
  using Numbers = std::array<float, 3>;
  struct Row {
    std::array<std::uint32_t, 3> corners;
    Numbers shares;
    Numbers normal;  // sqrt(w) n
  };
  struct Corner {
    std::uint32_t row;
    Numbers normal;  // b_s sqrt(w) n
  };
  std::span<const SurfaceRow> given_;
  Workers& workers_;
  std::vector<Row> rows_;
  std::vector<double> along_;            // (rows,) the products of rows and a step
  std::vector<std::uint32_t> first_of_;  // (k + 1,) of each vertex in corners_
  std::vector<Corner> corners_;
};

}  // namespace dynmesh
