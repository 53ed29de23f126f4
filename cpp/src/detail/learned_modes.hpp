/// Learning on the way: the modes of the frames that were completed, and the fit of these modes.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <dynmesh/topology.hpp>
#include <dynmesh/types.hpp>
#include <span>
#include <vector>

#include "detail/constants.hpp"
#include "detail/memory.hpp"
#include "detail/modes.hpp"
#include "detail/shape_fit.hpp"
#include "kernels/kernels.hpp"
#include "support/workers.hpp"

namespace dynmesh {

/// Holds z = Q^T K V - m_0 of up to 28 frames, in single precision, and the products of these
/// shapes over each part of the surface. Allocates memory only in the constructor.
///
/// The shapes are as different as possible: when there are too many, the older one of the two that
/// are closest leaves. A motion that repeats therefore does not push out the poses that are rare.
///
/// A shape keeps its slot until a later one takes it, also after it has left the library. The modes
/// in use can therefore be formed again from the slots when a state is restored: a slot that they
/// need is free for eight frames before it is taken, and by then modes made without it are in use.
class ShapeLibrary {
 public:
  /// The numbers of one vertex: x of all slots, then y, then z.
  using Row = std::array<float, std::size_t{3} * most_learned_shapes>;

  ShapeLibrary(const SurfaceParts& parts, Workers& workers, double mean_edge);

  /// Offers the shape of a completed frame, (k,) m, m_first - m and u. Every second one enters.
  /// Returns whether this one has entered.
  bool offer(std::span<const ShapeTerms> memory);

  /// How many shapes were offered.
  [[nodiscard]] std::uint64_t n_offered() const { return n_offered_; }
  /// The slots of the shapes, the oldest first.
  [[nodiscard]] std::span<const Index> members() const { return {order_.data(), n_members_}; }
  /// sum_i w_i z_i . z'_i of the shapes in two slots over a part.
  [[nodiscard]] double product(std::size_t part, Index slot, Index other) const {
    return products_[(part * slots + static_cast<std::size_t>(slot)) * slots +
                     static_cast<std::size_t>(other)];
  }
  [[nodiscard]] ShapeData shapes() const { return {rows_.front().data(), weights_.data()}; }
  [[nodiscard]] std::span<const Row> rows() const { return rows_; }

  template <class Self, class Visit>
  static void fields(Self& self, const Visit& visit) {
    visit(self.n_offered_);
    visit(self.n_members_);
    visit(self.order_);
    for (auto& row : self.rows_) visit(row);
  }
  /// Ends reading them.
  void recall();

 private:
  static constexpr std::size_t slots = most_learned_shapes;
  static constexpr std::size_t most_members = 28;

  void store(std::span<const ShapeTerms> memory, Index slot);
  void multiply(Index slot);
  [[nodiscard]] std::size_t least_needed() const;
  void release(std::size_t member);

  Workers& workers_;
  double largest_coordinate_;
  std::size_t n_parts_;
  std::vector<Index> offsets_;
  std::vector<Index> parts_;
  std::vector<float> weights_;
  std::vector<Row> rows_;
  std::vector<double> products_;          // (n_parts, slots, slots)
  std::vector<double> partial_products_;  // (chunks, n_parts, slots)
  /// The slots of the members, the oldest first, and then the free ones, the longest free first.
  std::array<Index, slots> order_{};
  std::uint64_t n_members_ = 0;
  std::uint64_t n_offered_ = 0;
};

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
