/// What method detail remembers of the shape, in the axes of frame 0.
#pragma once

#include <cstddef>
#include <dynmesh/types.hpp>
#include <span>
#include <vector>

#include "detail/constants.hpp"

namespace dynmesh {

/// m_first, the detail of frame 0; m, that of the last completed frame; and u, how m has lately
/// been changing from frame to frame. Allocates in the constructor only.
class ShapeMemory {
 public:
  using Field = std::span<const Vector3<double>>;

  ShapeMemory(std::size_t n_vertices, const DetailConstants& constants);

  /// Begins with frame 0, whose detail is `first` (k,). `mean_edge` is that of frame 0.
  void reset(Field first, double mean_edge);

  /// Takes the detail (k,) of a completed frame, turned back to the axes of frame 0, and learns how
  /// it has changed.
  void learn(Field detail);

  /// Sets the detail of the last completed frame, and how it has been changing, as they were.
  void recall(Field detail, Field change);

  /// m, m_first - m and u of each vertex, side by side: (3 k,).
  [[nodiscard]] Field shapes() const { return shapes_; }
  /// u of a vertex.
  [[nodiscard]] const Vector3<double>& change(std::size_t v) const { return shapes_[3 * v + 2]; }

 private:
  void set(std::size_t v, const Vector3<double>& detail, const Vector3<double>& change);

  double newest_;
  std::vector<Vector3<double>> first_;
  std::vector<Vector3<double>> shapes_;
  double mean_edge_ = 1;
};

}  // namespace dynmesh
