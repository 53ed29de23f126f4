/// The standard errors of completed positions; see docs/method.md, "Standard errors".
#pragma once

#include <cstddef>
#include <cstdint>
#include <dynmesh/topology.hpp>
#include <dynmesh/types.hpp>
#include <limits>
#include <span>
#include <vector>

#include "base/stored_numbers.hpp"
#include "base/workers.hpp"
#include "frame/generations.hpp"
#include "shape/detail_operator.hpp"
#include "shape/rotations.hpp"
#include "shape/shape_system.hpp"

namespace dynmesh {

/// Squares of residuals, or sums of them over earlier frames, each weighted less than the next: x
/// is that of the residuals found in the frames, y that of the residuals expected by the ensemble.
using Energy = Vector3<double>;

/// A frame that has been completed, (k,) each.
struct CompletedShape {
  std::span<const Vector3<double>> x;
  std::span<const Vector3<double>> kx;     ///< K X
  std::span<const Vector3<double>> shape;  ///< the shape that K X was to have
  double rounding = 0;                     ///< the mean square of rounding errors of a shape
};

/// What anchors are off by: nothing, or noise, whose size follows from their weight, which is the
/// squared ratio of the errors of the shape and of the anchors, or for planes from residuals.
enum class AnchorNoise : std::uint8_t { exact, by_weight, of_planes };

/// Carries the members of an ensemble of errors through the equations that the errors of the
/// completion obey, and scales them by the residuals of the frames. Each vertex has three of them,
/// which are vectors, hence nine numbers that measure how far a coordinate may be off.
///
/// Without `are_wanted`, there are none, and nothing is allocated. Allocates memory only in the
/// constructor. All numbers are the same for any number of threads.
class ErrorBars {
 public:
  using Field = std::span<const Vector3<double>>;

  /// `cells` and `workers` must outlive this object.
  ErrorBars(const Cells& cells, Workers& workers, bool are_wanted, AnchorNoise noise);

  [[nodiscard]] bool exist() const { return !errors_.empty(); }

  /// Finds the errors of a frame of which some vertices were solved for.
  void update(const CompletedShape& frame, const Anchors& anchors, const Generations& generations,
              ShapeSystem& system, const Clusters& clusters);

  /// The same for a frame of which nothing was solved for: everything is known or disconnected.
  void pass(const Generations& generations, const Clusters& clusters);

  /// Adds an independent error of this size to those of the vertices that are no anchors, in this
  /// frame alone.
  void widen(const Generations& generations, double size);

  /// (k,) the standard error of a coordinate in the unit of the positions: 0 for exact anchors,
  /// infinity for disconnected vertices. At anchors that are planes, that along their normals.
  /// Empty if there are none.
  [[nodiscard]] std::span<const double> of_vertices() const { return standard_errors_; }

  /// What later frames depend on, beside `of_vertices`, which a state keeps as well.
  template <class Self, class Visit>
  static void fields(Self& self, const Visit& visit) {
    for (auto* members_of : {&self.errors_, &self.changes_}) {
      for (auto& one : *members_of) visit(std::span(&one.x, 3));
    }
    if (!self.exist()) return;
    for (auto& energy : self.energies_) {
      visit(energy.x);
      visit(energy.y);
    }
    visit(self.energy_.x);
    visit(self.energy_.y);
    if (self.noise_kind_ == AnchorNoise::of_planes) {
      for (auto* energy : {&self.noise_energy_, &self.shape_energy_}) {
        visit(energy->x);
        visit(energy->y);
      }
    }
    visit(self.frame_);
  }
  void write_memory(Writer& writer) const;
  void read_memory(Reader& reader);

 private:
  static constexpr double infinite = std::numeric_limits<double>::infinity();
  static constexpr std::size_t members = 3;
  /// Members are numbers around 1 that grow slowly; only an invented state has larger ones.
  static constexpr double largest_member = 1e50;
  using Members = std::vector<Vector3<double>>;  // (3 k,), those of a vertex side by side

  void draw_changes(const Clusters& clusters);
  void set_noise(const Anchors& anchors);
  [[nodiscard]] double noise_size() const;
  Energy compare(const CompletedShape& frame, Field steps, const Anchors& anchors);
  void learn_sizes();
  void find_sizes();
  void end_frame(Field steps, double scale, const Generations& generations);
  void look_along_normals(Field steps, double scale, const Anchors& anchors);

  const Cells& cells_;
  Workers& workers_;
  AnchorNoise noise_kind_;
  DetailOperator smoother_;  // w -> (w + W w) / 2, W the mean of the cell

  // Kept from frame to frame:
  Members errors_;                // e, of the shape in memory
  Members changes_;               // eta, how the true shape changes, with unit size
  std::vector<Energy> energies_;  // (k,) of earlier frames, around each vertex, for sizes of 1
  std::vector<double> sizes_;     // (k,) of the changes, which follow from these energies
  Energy energy_;                 // of earlier frames, over the mesh
  Energy noise_energy_, shape_energy_;   // of recent frames, over the mesh, for noise of size 1
  std::uint64_t frame_ = 0;              // the number of frames since the ensemble was begun
  std::vector<double> standard_errors_;  // (k,)

  // Of one frame:
  Members targets_, next_, noise_;
  std::vector<Energy> newest_, averaged_;  // (k,); averaged_ first has the energies of the noise
};

}  // namespace dynmesh
