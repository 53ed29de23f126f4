/// The shape that method detail stores, in the axes of frame 0.
#pragma once

#include <cstddef>
#include <dynmesh/types.hpp>
#include <span>
#include <vector>

#include "detail/constants.hpp"
#include "detail/shape_terms.hpp"
#include "support/workers.hpp"

namespace dynmesh {

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
