/// A surface as one sensor sees it.
#pragma once

#include <Eigen/Geometry>
#include <array>
#include <cstddef>
#include <dynmesh/types.hpp>
#include <vector>

namespace dynmesh {

/// From where a surface is seen, and the number of the sensor there.
struct Viewpoint {
  Eigen::Vector3d position;
  std::size_t sensor;
};

/// The sensors, at most 24 of them, evenly chosen; without any, the corners of an icosahedron
/// around a box, far away.
std::vector<Viewpoint> viewpoints_of(Field sensors, const Eigen::AlignedBox3d& box);

/// Where a sensor sees the vertices of a surface, in an image that they fill.
class View {
 public:
  /// A place in the image, in pixels from its corner, and the depth.
  using Place = std::array<double, 3>;

  /// The sensor looks to the middle of the box around X (k,), in which it must not be. A mean edge
  /// is about so many pixels long.
  View(Field x, const Eigen::Vector3d& sensor, const Eigen::AlignedBox3d& box, double mean_edge,
       double pixels_of_edge);

  /// Where a position is seen; the depth is not positive if that is behind the sensor.
  [[nodiscard]] Place place_of(const Vector3& position) const;
  [[nodiscard]] const Place& place_of(std::size_t vertex) const { return vertices_[vertex]; }
  /// Whether the surface has any extent.
  [[nodiscard]] bool any() const { return width_ > 0; }
  [[nodiscard]] std::ptrdiff_t width() const { return width_; }
  [[nodiscard]] std::ptrdiff_t height() const { return height_; }
  /// The width of a pixel at a depth of 1.
  [[nodiscard]] double pixel_width() const { return pixel_; }

 private:
  Eigen::Vector3d sensor_, axis_, right_, up_;
  double pixel_ = 1;
  Eigen::Vector2d corner_{0, 0};  // of the image, at depth 1
  std::vector<Place> vertices_;
  std::ptrdiff_t width_ = 0;
  std::ptrdiff_t height_ = 0;
};

}  // namespace dynmesh
