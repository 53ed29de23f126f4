/// Learning on the way: the modes of the frames that were completed, and the fit of these modes.
#pragma once

#include <array>
#include <cstddef>
#include <dynmesh/topology.hpp>
#include <dynmesh/types.hpp>
#include <span>
#include <vector>

#include "detail/constants.hpp"
#include "detail/modes.hpp"
#include "detail/shape_fit.hpp"
#include "detail/shape_library.hpp"
#include "support/workers.hpp"

namespace dynmesh {

/// Makes the modes of a fit from a library of shapes that grows with the sequence. After every
/// fourth frame that is offered, new modes are begun, in slices of one frame each: first the
/// leading eigenvectors of all parts, then the modes of a third of the vertices at a time. When all
/// are complete, they replace the modes in use. Allocates memory only in the constructor.
class LearnedModes {
 public:
  /// `cells`, `workers` and `constants` must outlive this object.
  LearnedModes(const SurfaceParts& parts, const Cells& cells, Workers& workers,
               const TrainingConstants& constants, const ModeScale& scale);

  /// The fit of the modes in use.
  [[nodiscard]] ShapeFit& fit() { return fit_; }

  /// Continues after a completed frame. `memory` is as for ShapeLibrary::offer; the frame is
  /// offered only if it `is_evident`.
  void advance(std::span<const ShapeTerms> memory, bool is_evident);

  template <class Self, class Visit>
  static void fields(Self& self, const Visit& visit) {
    ShapeFit::fields(self.fit_, visit);
    ShapeLibrary::fields(self.library_, visit);
    visit(self.n_slices_);
    visit(self.has_changed_);
    for (auto* combination : {&self.used_, &self.making_}) {
      visit(combination->n_members);
      visit(combination->members);
    }
    visit(self.used_.factors);
  }
  /// Ends reading them: forms the modes in use, and those in the making as far as they were.
  void recall();

 private:
  static constexpr std::size_t slots = most_learned_shapes;

  /// Modes as combinations of the shapes in some slots.
  struct Combination {
    explicit Combination(std::size_t n_parts) : factors(n_parts * slots * modes_of_part) {}
    [[nodiscard]] CombinationData data() const {
      return {members.data(), static_cast<Index>(n_members), factors.data()};
    }
    [[nodiscard]] std::size_t n_modes() const;
    [[nodiscard]] std::size_t at(std::size_t part, std::size_t member) const {
      return (part * slots + member) * modes_of_part;
    }

    std::array<Index, slots> members{};
    std::uint64_t n_members = 0;
    std::vector<float> factors;  // (n_parts, slots, 16), U / sqrt(n)
  };

  void make_slice();
  void combine();
  void combine_part(std::size_t part);
  void form(Index slice);

  Workers& workers_;
  const TrainingConstants& constants_;
  ModeScale scale_;
  std::size_t n_parts_;
  std::vector<double> weights_;  // of the parts
  ShapeLibrary library_;
  ShapeFit fit_;
  Modes next_;             // in the making
  Index n_slices_ = 0;     // the slice that comes next, from 1; 0 if no modes are in the making
  Index has_changed_ = 0;  // whether the library has, since modes were last begun
  Combination used_;
  Combination making_;
};

}  // namespace dynmesh
