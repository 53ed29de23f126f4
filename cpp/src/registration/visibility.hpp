/// Which vertices of a surface the sensors can see.
#pragma once

#include <array>
#include <cstdint>
#include <dynmesh/types.hpp>
#include <span>
#include <vector>

#include "mesh/triangle.hpp"

namespace dynmesh {

/// What a sensor can see of a vertex.
enum class Sight : std::uint8_t { hidden, front, back, both };

/// Draws the surface as each sensor sees it, in a small depth image: what is drawn behind something
/// else is hidden. Allocates memory only in the constructor.
class Visibility {
 public:
  using Field = std::span<const Vector3<double>>;

  explicit Visibility(std::size_t n_vertices);

  /// What is compared with what is drawn; lengths.
  struct Tolerances {
    double pixel;  ///< the width of a pixel at the centre of the surface, about
    double front;  ///< how far behind the front a vertex may lie
    double back;   ///< the same for one that is seen from behind, to which the front may be near
  };

  /// Finds (k,) what of each vertex can be seen from the viewpoints: the front if it faces one that
  /// nothing hides it from, and the back if it faces away from one like that and `is_sheet` (k,).
  /// Without viewpoints, that is the front of all. `normals` (k,) are those of the vertices. A
  /// surface that surrounds a viewpoint hides no front from it, and shows no back.
  void find(std::span<const Triangle> faces, Field frame, Field normals, Field viewpoints,
            std::span<const std::uint8_t> is_sheet, const Tolerances& tolerances,
            std::span<Sight> seen);

 private:
  static constexpr int most_pixels = 512;  // along a side

  void draw(std::span<const Triangle> faces, int side);

  std::vector<Vector3<double>> image_;  // (k,) column, row, depth
  std::vector<float> depths_;
};

}  // namespace dynmesh
