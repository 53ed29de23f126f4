/// Depth images: what cameras measured along the rays of their pixels.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <dynmesh/types.hpp>
#include <vector>

#include "support/workers.hpp"
#include "tracking/measurement.hpp"

namespace dynmesh {

/// A pinhole camera that looks along its +z axis, with x to the right and y down. Pixel (column,
/// row) sees along (column - cx) / fx, (row - cy) / fy, 1, where the skew s adds to the column.
struct Camera {
  double fx, fy, cx, cy, skew;
  std::array<Vector3<double>, 3> axes;  ///< right, down and ahead, in the axes of the template
  Vector3<double> position;

  [[nodiscard]] Vector3<double> to_camera(const Vector3<double>& point) const;
  [[nodiscard]] Vector3<double> from_camera(const Vector3<double>& local) const;
  /// The point at a depth in a pixel.
  [[nodiscard]] Vector3<double> at(std::size_t row, std::size_t column, double depth) const;
};

/// Finds correspondences by projection: a vertex is drawn into each image, and the pixels around it
/// are examined, which takes no search tree. Allocates memory where images, or their measured
/// parts, are larger than all earlier ones.
class DepthImages final : public Measurement {
 public:
  /// The rows of an image of the frame, to be filled in by the caller with depths along `ahead`;
  /// anything that is not positive and finite means that nothing was measured.
  struct Image {
    Camera camera;
    std::size_t height = 0;
    std::size_t width = 0;
    std::size_t first = 0;  // of its pixels in the arrays
  };

  void clear();
  /// Adds an image and returns its pixels, row by row.
  std::span<float> add(const Camera& camera, std::size_t height, std::size_t width);

  /// Finds the points and normals of all pixels. A normal is that of the differences to the
  /// neighbouring pixels of the same surface, which are at most `jump` nearer or farther. A pixel
  /// without such a neighbour in its row or in its column says nothing.
  void prepare(double jump, Workers& workers);

  [[nodiscard]] Field viewpoints() const override { return viewpoints_; }
  [[nodiscard]] std::size_t size() const override { return points_.size(); }
  [[nodiscard]] Vector3<double> point(std::size_t i) const override { return points_[i]; }
  [[nodiscard]] Vector3<double> normal(std::size_t i) const override { return normals_[i]; }
  [[nodiscard]] bool is_undecided(std::size_t /*i*/) const override { return false; }
  [[nodiscard]] std::size_t sensor_of(std::size_t i) const override;
  /// Among 5 by 5 pixels.
  [[nodiscard]] double squared_spacing(std::size_t i, std::size_t neighbours) const override;
  [[nodiscard]] Correspondence nearest(const Vector3<double>& position,
                                       const Vector3<double>& normal, double radius,
                                       double agreement, std::uint32_t guess) const override;
  /// The pixel of the position is measured, and so are most around it; all of them are farther. A
  /// surface that is nearly edge-on to the camera may be thinner than a pixel.
  [[nodiscard]] bool is_free(const Vector3<double>& position, const Vector3<double>& normal,
                             double margin) const override;

 private:
  class Search;
  [[nodiscard]] bool is_free_in(const Image& image, const Vector3<double>& position,
                                double margin) const;

  /// The pixels of the same surface around one: itself where there is none on that side.
  struct Neighbours {
    std::size_t left, right, above, below;

    [[nodiscard]] bool have_a_plane() const { return left != right && above != below; }
  };
  [[nodiscard]] Neighbours neighbours(const Image& image, std::size_t row, std::size_t column,
                                      double jump) const;
  void prepare_row(const Image& image, std::size_t row, double jump, std::uint32_t number);

  std::vector<Image> images_;
  std::vector<float> depths_;
  std::vector<std::uint32_t> numbers_;  // of the point of each pixel, or no_guess
  std::vector<std::uint32_t> first_of_row_;
  std::vector<std::uint32_t> ends_;       // of the points of each image
  std::vector<Vector3<double>> points_;   // in the axes of the template
  std::vector<Vector3<double>> normals_;  // 0 where the neighbours lie on a line
  std::vector<Vector3<double>> viewpoints_;
};

}  // namespace dynmesh
