/// Depth images: what cameras measured along the rays of their pixels.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <dynmesh/types.hpp>
#include <vector>

#include "support/workers.hpp"
#include "tracking/point_scan.hpp"

namespace dynmesh {

/// A pinhole camera that looks along its +z axis, with x to the right and y down. Pixel (column,
/// row) sees along (column - cx) / fx, (row - cy) / fy, 1, where the skew s adds to the column.
struct Camera {
  double fx, fy, cx, cy, skew;
  std::array<Vector3<double>, 3> axes;  ///< right, down and ahead, in the axes of the template
  Vector3<double> position;

  [[nodiscard]] Vector3<double> from_camera(const Vector3<double>& local) const;
  /// The point at a depth in a pixel.
  [[nodiscard]] Vector3<double> at(std::size_t row, std::size_t column, double depth) const;
};

/// The depth images of a frame. Allocates memory where images, or their measured parts, are larger
/// than all earlier ones.
class DepthImages {
 public:
  void clear();
  /// Adds an image and returns its pixels, row by row, to be filled in by the caller with depths
  /// along `ahead`; anything that is not positive and finite means that nothing was measured.
  std::span<float> add(const Camera& camera, std::size_t height, std::size_t width);

  /// Replaces a scan by the points of the pixels. A normal is that of the differences to the
  /// neighbouring pixels of the same surface, which are at most `jump` nearer or farther. A pixel
  /// without such a neighbour in its row or in its column says nothing. If there are more than
  /// `most` points, only every second, third ... row and column counts.
  void convert(double jump, std::size_t most, Workers& workers, PointScan& scan) const;

 private:
  struct Image {
    Camera camera;
    std::size_t height = 0;
    std::size_t width = 0;
    std::size_t first = 0;  // of its pixels
  };
  /// The pixels of the same surface around one: itself where there is none on that side.
  struct Neighbours {
    std::size_t left, right, above, below;

    [[nodiscard]] bool have_a_plane() const { return left != right && above != below; }
  };
  [[nodiscard]] Neighbours neighbours(const Image& image, std::size_t row, std::size_t column,
                                      double jump) const;

  std::vector<Image> images_;
  std::vector<float> depths_;
};

}  // namespace dynmesh
