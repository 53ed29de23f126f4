/// The shape that method detail stores, in the axes of frame 0.
#pragma once

#include <cstddef>
#include <dynmesh/types.hpp>
#include <span>
#include <vector>

#include "detail/constants.hpp"

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
  void learn(Field detail);

  /// Restores m and u.
  void recall(Field detail, Field change);

  /// m, m_first - m and u of each vertex, side by side: (3 k,).
  [[nodiscard]] Field shapes() const { return shapes_; }
  /// u of vertex v.
  [[nodiscard]] const Vector3<double>& change(std::size_t v) const { return shapes_[3 * v + 2]; }

 private:
  void set(std::size_t v, const Vector3<double>& detail, const Vector3<double>& change);

  double newest_;
  std::vector<Vector3<double>> first_;
  std::vector<Vector3<double>> shapes_;
  double mean_edge_ = 1;
};

}  // namespace dynmesh
