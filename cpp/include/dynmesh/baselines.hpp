/// The methods that the paper compares itself with (section 4, "Comparison Methods"): each frame by
/// itself, from its known vertices and the Laplacian of the connectivity.
///
/// `previous`, a whole frame, makes either method work on motion vectors instead of positions: the
/// fair comparison for a method that knows the past. A null view means positions.
#pragma once

#include <dynmesh/export.hpp>
#include <dynmesh/topology.hpp>
#include <dynmesh/types.hpp>
#include <memory>
#include <string_view>

namespace dynmesh {

/// Least-squares meshes (Sorkine and Cohen-Or 2004): minimise |L x|^2 + sum over the known vertices
/// of |x_i - given_i|^2, with L = D - R, eq. (2). Known vertices move. A sparse Cholesky
/// factorisation for each mask; its ordering is found once, in the constructor.
class DYNMESH_EXPORT LeastSquaresMesh {
 public:
  explicit LeastSquaresMesh(const Topology& topology);
  ~LeastSquaresMesh();
  LeastSquaresMesh(LeastSquaresMesh&&) noexcept;
  LeastSquaresMesh& operator=(LeastSquaresMesh&&) noexcept;
  LeastSquaresMesh(const LeastSquaresMesh&) = delete;
  LeastSquaresMesh& operator=(const LeastSquaresMesh&) = delete;

  /// (k, 3) in, (k, 3) out; `completed` may be `points`. Throws std::invalid_argument for other
  /// counts, a known position that is not finite, and a component without a known vertex, which
  /// could be anywhere.
  void complete(Points<const double> points, KnownMask known, Points<const double> previous,
                Points<double> completed);

 private:
  struct System;
  std::unique_ptr<System> system_;
};

enum class Objective {
  harmonic,      ///< (L x)_i = 0 at every unknown vertex
  least_squares  ///< minimise |L x| over all rows
};
enum class Weights {
  uniform,          ///< L = D - R, eq. (2)
  inverse_distance  ///< 1 / |v_i - v_j| of a reference frame in place of the ones of R
};

/// "harmonic" or "least_squares". Throws std::invalid_argument for another name.
DYNMESH_EXPORT Objective objective_from_name(std::string_view name);
/// "uniform" or "inverse_distance". Throws std::invalid_argument for another name.
DYNMESH_EXPORT Weights weights_from_name(std::string_view name);

/// Laplacian interpolation (Oostendorp, van Oosterom and Huiskamp 1989): known vertices stay, the
/// others make the surface smooth. A sparse Cholesky factorisation for each mask, kept while the
/// mask stays the same.
class DYNMESH_EXPORT LaplacianInterpolation {
 public:
  /// `reference`: (k, 3), the frame that `inverse_distance` is measured on; null for `uniform`.
  LaplacianInterpolation(const Topology& topology, Objective objective, Weights weights,
                         Points<const double> reference);
  ~LaplacianInterpolation();
  LaplacianInterpolation(LaplacianInterpolation&&) noexcept;
  LaplacianInterpolation& operator=(LaplacianInterpolation&&) noexcept;
  LaplacianInterpolation(const LaplacianInterpolation&) = delete;
  LaplacianInterpolation& operator=(const LaplacianInterpolation&) = delete;

  /// As LeastSquaresMesh::complete, but known vertices come back exactly as given.
  void complete(Points<const double> points, KnownMask known, Points<const double> previous,
                Points<double> completed);

 private:
  struct System;
  std::unique_ptr<System> system_;
};

}  // namespace dynmesh
