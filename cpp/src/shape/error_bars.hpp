/// The standard errors of completed positions; see docs/method.md, "Standard errors".
#pragma once

#include <cstddef>
#include <cstdint>
#include <dynmesh/topology.hpp>
#include <dynmesh/types.hpp>
#include <limits>
#include <span>
#include <vector>

#include "base/lender.hpp"
#include "base/workers.hpp"
#include "frame/generations.hpp"
#include "shape/detail_operator.hpp"
#include "shape/memory.hpp"
#include "shape/rotations.hpp"
#include "shape/shape_system.hpp"

namespace dynmesh {

/// A frame that has been completed, (k,) each.
struct CompletedShape {
  Field x;
  Field kx;             ///< K X
  Field shape;          ///< the shape that K X was to have
  double rounding = 0;  ///< the mean square of rounding errors of a shape
};

/// What anchors are off by: nothing, or noise, whose size follows from their weight, which is the
/// squared ratio of the errors of the shape and of the anchors, or for planes from residuals.
enum class AnchorNoise : std::uint8_t { exact, by_weight, of_planes };

/// Carries the members of an ensemble of errors through the equations that the errors of the
/// completion obey, and scales them by the residuals of the frames. Each vertex has three of them,
/// which are vectors, hence nine numbers that measure how far a coordinate may be off.
///
/// Without `are_wanted`, there are none, and nothing is allocated. Allocates memory only in the
/// constructor. All numbers are the same for any number of threads. Each frame begins with what
/// was remembered of the one before, `memory`, and writes what is remembered of it, `next`.
class ErrorBars {
 public:
  /// `cells` and `workers` must outlive this object.
  ErrorBars(const Cells& cells, Workers& workers, bool are_wanted, AnchorNoise noise);

  [[nodiscard]] bool exist() const { return size_ > 0; }
  /// The memory of frame 0.
  [[nodiscard]] ErrorMemory no_errors() const;

  /// Finds the errors of a frame of which some vertices were solved for.
  void update(const CompletedShape& frame, ShapeFactor& factor, const Generations& generations,
              ShapeSystem& system, const Clusters& clusters, const ErrorMemory& memory,
              ErrorMemory& next);

  /// Finds the errors of a frame of which nothing was solved for: all is known or disconnected.
  void pass(const Generations& generations, const Clusters& clusters, const ErrorMemory& memory,
            ErrorMemory& next);

  /// Adds an independent error of this size to those of the vertices that are no anchors, in this
  /// frame alone.
  static void widen(const Generations& generations, double size, ErrorMemory& next);

 private:
  static constexpr double infinite = std::numeric_limits<double>::infinity();
  static constexpr std::size_t members = 3;
  /// Members are numbers around 1 that grow slowly; only an invented state has larger ones.
  static constexpr double largest_member = 1e50;
  using Members = std::vector<Vector3>;  // (3 k,), those of a vertex side by side
  /// What is made up for a frame.
  struct Changes {
    explicit Changes(std::size_t k) : targets(members * k), sizes(k) {}

    Members targets;            // T, the errors of the shape that the frame is to have
    std::vector<double> sizes;  // (k,) of the changes, which follow from the energies
  };
  /// (k,) of the residuals of a frame, of the shape and of noise.
  struct Energies {
    explicit Energies(std::size_t k) : of_shape(k), of_noise(k) {}

    std::vector<Energy> of_shape, of_noise;
  };

  Lent<Changes> draw_changes(const Clusters& clusters, const ErrorMemory& memory,
                             ErrorMemory& next);
  Lent<Members> noise_of(const Anchors& anchors, Field targets, const ErrorMemory& memory,
                         ErrorMemory& next);
  bool carry_on(const CompletedShape& frame, ShapeFactor& factor, const Generations& generations,
                ShapeSystem& system, const Clusters& clusters, const ErrorMemory& memory,
                ErrorMemory& next);
  Lent<Energies> compare(const CompletedShape& frame, const Anchors& anchors, Field targets,
                         Field noise, Field steps, Field k_steps);
  void learn_sizes(std::span<const double> sizes, Energies& newest, const ErrorMemory& memory,
                   ErrorMemory& next);
  void look_along_normals(Field steps, double scale, const Anchors& anchors, Energies& seen,
                          ErrorMemory& next);
  void find_sizes(std::span<const Energy> energies, std::span<double> sizes);
  void end_frame(Field targets, Field steps, double scale, const Generations& generations,
                 ErrorMemory& next);

  const Cells& cells_;
  Workers& workers_;
  std::size_t size_;  // k, or 0 if they are not wanted
  AnchorNoise noise_kind_;
  DetailOperator smoother_;  // w -> (w + W w) / 2, W the mean of the cell
  Lender<Changes> changes_;
  Lender<Members> members_;
  Lender<Energies> energies_;
};

}  // namespace dynmesh
