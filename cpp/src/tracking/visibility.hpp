/// Which vertices of a surface the sensors can see.
#pragma once

#include <cstdint>
#include <dynmesh/types.hpp>
#include <span>
#include <vector>

#include "detail/intrinsic_delaunay.hpp"

namespace dynmesh {

/// Draws the surface as each sensor sees it, in a small depth image: what is drawn behind something
/// else is hidden. Allocates memory only in the constructor.
class Visibility {
 public:
  using Field = std::span<const Vector3<double>>;

  explicit Visibility(std::size_t n_vertices);

  /// Sets `seen` (k,) to 1 for the vertices that face one of the viewpoints and that nothing hides
  /// from it, else to 0; without viewpoints, to 1 for all. `normals` (k,) are those of the
  /// vertices. Depths are compared with a tolerance of `tolerance`, and a pixel is about `pixel`
  /// wide at the centre of the surface, both lengths. A surface that surrounds a viewpoint hides
  /// nothing from it.
  void find(std::span<const Triangle> faces, Field frame, Field normals, Field viewpoints,
            double pixel, double tolerance, std::span<std::uint8_t> seen);

 private:
  static constexpr int most_pixels = 512;  // along a side

  void draw(std::span<const Triangle> faces, int side);

  std::vector<Vector3<double>> image_;  // (k,) column, row, depth
  std::vector<float> depths_;
};

}  // namespace dynmesh
