/// The two methods that the paper compares its own method with (section 4, "Comparison Methods").
/// Both complete each frame separately, from its known vertices and the Laplacian of the
/// connectivity.
///
/// If `previous`, a complete frame, is given, a method is applied to the motion vectors from that
/// frame instead of to the positions. This makes for a fair comparison with methods that use the
/// past. A null view means that positions are used.
#pragma once

#include <dynmesh/export.hpp>
#include <dynmesh/topology.hpp>
#include <dynmesh/types.hpp>
#include <memory>
#include <string_view>

namespace dynmesh {

enum class Objective {
  harmonic,      ///< (L x)_i = 0 at every unknown vertex
  least_squares  ///< minimise |L x| over all rows
};
enum class Weights {
  uniform,          ///< L = D - R, eq. (2)
  inverse_distance  ///< 1 / |v_i - v_j|, measured on a reference frame, replaces the ones of R
};

/// Returns the objective of this name, "harmonic" or "least_squares". Throws std::invalid_argument
/// for any other name.
DYNMESH_EXPORT Objective objective_from_name(std::string_view name);
/// Returns the weights of this name, "uniform" or "inverse_distance". Throws std::invalid_argument
/// for any other name.
DYNMESH_EXPORT Weights weights_from_name(std::string_view name);

/// What both methods solve with. They differ in `complete`.
class DYNMESH_EXPORT Baseline {
 public:
  ~Baseline();
  Baseline(Baseline&&) noexcept;
  Baseline& operator=(Baseline&&) noexcept;
  Baseline(const Baseline&) = delete;
  Baseline& operator=(const Baseline&) = delete;

 protected:
  Baseline(const Topology& topology, Objective objective, Weights weights,
           Points<const double> reference);

  struct System;
  std::unique_ptr<System> system_;
};

/// Least-squares meshes (Sorkine and Cohen-Or 2004): minimises |L x|^2 + sum over the known
/// vertices of |x_i - given_i|^2, with L = D - R, eq. (2). Known vertices move. Each known mask
/// requires one sparse Cholesky factorisation, whose ordering is computed once, in the constructor.
class DYNMESH_EXPORT LeastSquaresMesh : public Baseline {
 public:
  explicit LeastSquaresMesh(const Topology& topology)
      : Baseline(topology, Objective::least_squares, Weights::uniform, {}) {}

  /// All views are (k, 3), and `completed` may be the same view as `points`. Throws
  /// std::invalid_argument if a view has another number of rows, if a known position is not finite,
  /// or if a component of the mesh has no known vertex, since its position would then be
  /// undetermined.
  void complete(Points<const double> points, KnownMask known, Points<const double> previous,
                Points<double> completed);
};

/// Laplacian interpolation (Oostendorp, van Oosterom and Huiskamp 1989): known vertices keep their
/// positions, and the others are placed so that the surface is smooth. Each known mask takes one
/// sparse Cholesky factorisation, which is reused while the mask does not change.
class DYNMESH_EXPORT LaplacianInterpolation : public Baseline {
 public:
  /// `reference` is the frame, (k, 3), on which `inverse_distance` is measured. It must be null for
  /// `uniform`.
  LaplacianInterpolation(const Topology& topology, Objective objective, Weights weights,
                         Points<const double> reference)
      : Baseline(topology, objective, weights, reference) {}

  /// Like LeastSquaresMesh::complete, except that known vertices are returned exactly as given.
  void complete(Points<const double> points, KnownMask known, Points<const double> previous,
                Points<double> completed);
};

}  // namespace dynmesh
