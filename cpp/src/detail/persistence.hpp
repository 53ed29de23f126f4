/// How much of a change of the shape persists to the next frame.
#pragma once

#include <dynmesh/topology.hpp>
#include <dynmesh/types.hpp>
#include <span>
#include <vector>

#include "detail/constants.hpp"
#include "detail/rotations.hpp"
#include "generations/generations.hpp"

namespace dynmesh {

/// The correlation of the changes of two successive frames, where both show them: all of the cell
/// is known, and the residual of the frame is the change. Allocates memory only in `allocate`.
class Persistence {
 public:
  /// `constants` must outlive this object.
  explicit Persistence(const UncertaintyConstants& constants) : constants_(constants) {}
  void allocate(std::size_t n_vertices);
  void reset();

  /// Adds a frame whose residuals are K X - shape, (k,) each.
  void learn(std::span<const Vector3<double>> kx, std::span<const Vector3<double>> shape,
             const Cells& cells, const Generations& generations, const Rotations& rotations);
  /// Adds a frame without residuals.
  void pass();

  /// From 0 to 1. Without any evidence, changes are taken to persist for a while, since motion
  /// does.
  [[nodiscard]] double value() const;

  /// What later frames depend on, beside the sums: of each vertex, the residual of the last frame
  /// in the axes of frame 0, and whether all of its cell was known then.
  struct OfVertex {
    Vector3<double> residual;
    bool was_seen = false;
  };
  struct Sums {
    double product = 0, square = 0;  // of residuals of successive frames
  };
  [[nodiscard]] OfVertex of_vertex(std::size_t v) const {
    return {residuals_[v], are_seen_[v] != 0};
  }
  [[nodiscard]] const Sums& sums() const { return sums_; }
  void recall(std::size_t v, const OfVertex& remembered);
  void recall(const Sums& sums) { sums_ = sums; }

 private:
  const UncertaintyConstants& constants_;
  std::vector<Vector3<double>> residuals_;
  std::vector<std::uint8_t> are_seen_;
  Sums sums_;
  std::vector<Vector3<double>> newest_, turned_;  // of one frame
};

}  // namespace dynmesh
