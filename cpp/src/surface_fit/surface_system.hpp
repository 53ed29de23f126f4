/// The linear system of a surface that is drawn to measured points while its shape resists.
#pragma once

#include <cstddef>
#include <cstdint>
#include <dynmesh/topology.hpp>
#include <dynmesh/types.hpp>
#include <span>
#include <vector>

#include "mesh/ties.hpp"
#include "shape/model.hpp"
#include "shape/shape_system.hpp"
#include "surface_fit/coarse_space.hpp"
#include "surface_fit/constants.hpp"
#include "surface_fit/surface_rows.hpp"

namespace dynmesh {

/// A position to which a vertex is drawn.
struct Landmark {
  std::size_t vertex = 0;
  Vector3 target;
  double weight = 0;
};

/// A = N + mu C + ties + rows + landmarks, and a small weight that holds each vertex where nothing
/// else does. The rows tie the three coordinates together, so A has 3 k unknowns, and is solved by
/// conjugate gradients. Their preconditioner is the factor of N + mu C with the mean weights of the
/// rows at the vertices on the diagonal, which has k, and a coarse space.
class SurfaceSystem {
 public:
  /// `shape`, `constants`, `ties`, whose weights may change, and `workers` must outlive this
  /// object.
  SurfaceSystem(ShapeSystem& shape, const ShapeModel& model, const TrackingConstants& constants,
                std::span<const Tie> ties, Workers& workers);

  /// Factors the preconditioner for rows whose weights are multiplied by `factor`. It serves for
  /// others with about these weights, until the shape's system is factored for something else.
  void factorize(std::span<const SurfaceRow> rows, std::span<const Landmark> landmarks,
                 double factor);
  /// Returns to the last factor, after the shape's system was factored for something else.
  void factorize_again() { shape_.factorize(anchors_); }

  /// Adds the step D to X for which A D is the sum of `force` (k,), which is lost, and of the
  /// forces of the rows and landmarks at X. Ends at the share `settled` of the error.
  void solve(std::span<const SurfaceRow> rows, std::span<const Landmark> landmarks, double settled,
             std::span<Vector3> x, std::span<Vector3> force);

 private:
  [[nodiscard]] std::vector<double> held(std::span<const Landmark> landmarks) const;

  ShapeSystem& shape_;
  const TrackingConstants& constants_;
  Workers& workers_;
  std::span<const Tie> ties_;
  CoarseSpace coarse_;
  Anchors anchors_;  // all vertices are solved for
};

}  // namespace dynmesh
