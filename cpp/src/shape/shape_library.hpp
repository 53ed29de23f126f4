/// The shapes of which modes are made: those of a training sequence, or of completed frames.
#pragma once

#include <cstddef>
#include <cstdint>
#include <dynmesh/types.hpp>
#include <span>
#include <vector>

#include "base/workers.hpp"
#include "shape/memory.hpp"
#include "shape/model.hpp"
#include "shape/modes.hpp"

namespace dynmesh {

/// Holds the shapes z = Q^T K V - m_0 of some frames, in single precision, and the products of
/// these shapes over each part of the surface. Allocates memory only in the constructor.
///
/// The shapes are as different as possible: when there are too many, the older one of the two that
/// are closest leaves. A motion that repeats therefore does not push out the poses that are rare.
class ShapeLibrary {
 public:
  /// For at most `most` shapes, of which the mean square of rounding errors is `rounding`. `modes`
  /// are not set yet, and must outlive this object like `workers`.
  ShapeLibrary(const Modes& modes, std::size_t most, double mean_edge, double rounding,
               Workers& workers);

  /// Adds the shape that is `shape(v)` at vertex v.
  template <class Shape>
  void add(const Shape& shape) {
    const Index slot = order_[n_members_++];
    for (std::size_t v = 0; v < parts_.size(); ++v) {
      const Vector3 z = 1 / unit_ * shape(v);
      float* row = &rows_[3 * slots_ * v + static_cast<std::size_t>(slot)];
      row[0] = static_cast<float>(z.x);
      row[slots_] = static_cast<float>(z.y);
      row[2 * slots_] = static_cast<float>(z.z);
    }
    multiply(slot);
    if (n_members_ > most_) release_least_needed();
  }
  [[nodiscard]] std::size_t size() const { return n_members_; }

  /// Sets the modes to those of the shapes.
  void make(Modes& modes);

  /// What a state keeps of it.
  template <class Self, class Visit>
  static void each_number(Self& self, const Visit& visit) {
    visit(self.n_members_);
    visit(self.order_);
    visit(self.rows_);
  }
  /// Ends reading them.
  void multiply_all();

 private:
  void multiply(Index slot);
  [[nodiscard]] double product(std::size_t part, Index slot, Index other) const {
    return products_[(part * slots_ + static_cast<std::size_t>(slot)) * slots_ +
                     static_cast<std::size_t>(other)];
  }
  std::size_t find_modes(std::size_t part);
  void release_least_needed();

  Workers& workers_;
  const SurfaceParts& parts_;
  std::size_t most_;
  std::size_t slots_;
  std::size_t n_parts_;
  double unit_;                           // of the modes, so that squares are in the range of float
  double least_eigenvalue_;               // of a shape and a vertex
  std::vector<double> of_parts_;          // the sums of the weights of each part
  std::vector<float> rows_;               // of each vertex, x of all slots, then y, then z
  std::vector<double> products_;          // (n_parts, slots, slots)
  VertexSums<double> sums_;               // (n_parts, slots), the products of a shape
  std::vector<double> vectors_, values_;  // the eigenvectors and eigenvalues of a part
  std::vector<float> factors_;            // (n_parts, members, 16), U / sqrt(n)
  std::vector<Index> order_;  // the slots of the members, the oldest first, and then free ones
  std::uint64_t n_members_ = 0;
};

/// Modes of the shapes that a sequence has shown, which it learns as it goes.
class LearnedModes {
 public:
  /// `model` and `workers` must outlive this object.
  LearnedModes(const ShapeModel& model, Workers& workers);

  /// Adds some of the frames with anchors to the library, and makes new modes. Allocates no memory.
  void learn(const Memory& memory);

  [[nodiscard]] const Modes& modes() const { return modes_; }

  template <class Self, class Visit>
  static void each_number(Self& self, const Visit& visit) {
    ShapeLibrary::each_number(self.library_, visit);
    visit(self.n_evident_);
  }
  /// Ends reading them.
  void make();

 private:
  const ShapeModel& model_;
  Modes modes_;
  ShapeLibrary library_;
  std::uint64_t n_evident_ = 0;  // the number of frames with anchors
};

/// Returns the modes of the shapes of the frames V of a training sequence, in the axes of frame 0;
/// none without frames, and of mirror images of a closed surface. Those of a moved and turned
/// sequence are the same. All but the modes of the model is used.
Modes training_modes(std::span<const std::vector<Vector3>> training,
                     std::span<const Triangle> faces, const ShapeModel& model, Workers& workers);

}  // namespace dynmesh
