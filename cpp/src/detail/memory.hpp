/// The shape that method detail stores, in the axes of frame 0.
#pragma once

#include <cstddef>
#include <dynmesh/types.hpp>
#include <span>
#include <vector>

#include "detail/constants.hpp"
#include "support/workers.hpp"

namespace dynmesh {

/// At one vertex, the terms of the shape m + b (m_first - m) + c u, or what belongs to each of
/// them: the term in the axes of the current frame, the step towards it, or K times that step.
struct ShapeTerms {
  Vector3<double> last;     ///< m, the shape of the last frame
  Vector3<double> to_rest;  ///< m_first - m, of which b is added
  Vector3<double> change;   ///< u, of which c is added
};
static_assert(sizeof(ShapeTerms) == 3 * sizeof(Vector3<double>));

/// The same memory as fields that are stored side by side: (3 k,).
inline std::span<const Vector3<double>> side_by_side(std::span<const ShapeTerms> terms) {
  return {reinterpret_cast<const Vector3<double>*>(terms.data()), 3 * terms.size()};
}
inline std::span<Vector3<double>> side_by_side(std::span<ShapeTerms> terms) {
  return {reinterpret_cast<Vector3<double>*>(terms.data()), 3 * terms.size()};
}

/// Stores m_first, the detail of frame 0; m, the detail of the last completed frame; and u, the
/// recent change of m per frame. Allocates memory only in the constructor.
class ShapeMemory {
 public:
  using Field = std::span<const Vector3<double>>;

  ShapeMemory(std::size_t n_vertices, const DetailConstants& constants);

  /// Begins a sequence. `first` (k,) is the detail of frame 0, and `mean_edge` its mean edge
  /// length.
  void reset(Field first, double mean_edge);

  /// Updates m and u with the detail (k,) of a completed frame, rotated back to the axes of frame
  /// 0.
  void learn(Field detail, Workers& workers);

  /// Restores m; u is what `fields` visits.
  void recall(Field detail);
  template <class Self, class Visit>
  static void fields(Self& self, const Visit& visit) {
    for (auto& shape : self.shapes_) visit(std::span(&shape.change.x, 3));
  }

  /// m, m_first - m and u: (k,).
  [[nodiscard]] std::span<const ShapeTerms> shapes() const { return shapes_; }

 private:
  double newest_;
  std::vector<Vector3<double>> first_;
  std::vector<ShapeTerms> shapes_;
  double mean_edge_ = 1;
};

}  // namespace dynmesh
