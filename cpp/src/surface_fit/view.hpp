/// A surface as one sensor sees it.
#pragma once

#include <Eigen/Geometry>
#include <array>
#include <cstddef>
#include <dynmesh/topology.hpp>
#include <dynmesh/types.hpp>
#include <limits>
#include <span>
#include <vector>

namespace dynmesh {

/// From where a surface is drawn, and the number of the sensor there.
struct Viewpoint {
  Eigen::Vector3d position;
  std::size_t sensor;
};

/// The sensors, at most 24 of them, evenly chosen; without any, the corners of an icosahedron
/// around a box, far away.
std::vector<Viewpoint> drawn_from(Field sensors, const Eigen::AlignedBox3d& box);

/// An image of a surface, with about two pixels for each mean edge: of each pixel, what is nearest
/// (Catmull 1974). All arguments must outlive it.
class View {
 public:
  /// A place in the image, in pixels, and its depth.
  using Place = std::array<double, 3>;

  struct Pixel {
    double depth = std::numeric_limits<double>::infinity();
    Index component = -1;
  };

  /// `component` (k,) is that of each vertex; all are of one if it is empty. The sensor looks to
  /// the middle of the box around X (k,), in which it must not be.
  View(std::span<const Triangle> faces, std::span<const Index> component, Field x,
       const Eigen::Vector3d& sensor, const Eigen::AlignedBox3d& box, double mean_edge);

  /// Whether another component lies before a vertex.
  [[nodiscard]] bool hides(std::size_t vertex) const;
  /// Whether anything of the surface lies before a vertex by more than a distance.
  [[nodiscard]] bool covers(std::size_t vertex, double distance) const;
  /// Adds the number of its pixels to each component.
  void count(std::span<double> pixels) const;

  /// Where a position is seen; the depth is not positive if that is behind the sensor.
  [[nodiscard]] Place place_of(const Vector3& position) const;
  [[nodiscard]] const Place& place_of(std::size_t vertex) const { return corners_[vertex]; }
  /// 0 by 0 if the surface has no extent.
  [[nodiscard]] std::ptrdiff_t width() const { return width_; }
  [[nodiscard]] std::ptrdiff_t height() const { return height_; }
  /// The width of a pixel at a depth of 1.
  [[nodiscard]] double pixel_width() const { return pixel_; }

 private:
  [[nodiscard]] const Pixel& pixel_at(std::size_t vertex) const;
  void draw(const Triangle& face);

  std::span<const Index> component_;
  Eigen::Vector3d sensor_, axis_, right_, up_;
  double mean_edge_;
  double pixel_ = 1;
  Eigen::Vector2d corner_{0, 0};  // of the image, at depth 1
  std::vector<Place> corners_;    // of the triangles
  std::ptrdiff_t width_ = 0;
  std::ptrdiff_t height_ = 0;
  std::vector<Pixel> nearest_;
};

}  // namespace dynmesh
