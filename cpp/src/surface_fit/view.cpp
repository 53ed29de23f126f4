#include "surface_fit/view.hpp"

#include <algorithm>
#include <cmath>

#include "base/geometry.hpp"
#include "base/rigid_motion.hpp"

namespace dynmesh {
namespace {

constexpr double pixels_across = 640;  // at most, in each direction
/// Of more sensors, so many are used, evenly chosen: they surround the surface.
constexpr std::size_t most_views = 24;

/// From where a surface is seen on all sides: the corners of an icosahedron around it.
std::vector<Eigen::Vector3d> all_sides(const Eigen::AlignedBox3d& box) {
  constexpr double far = 10;  // sizes of the box
  const double golden = (1 + std::sqrt(5.0)) / 2;
  std::vector<Eigen::Vector3d> sides;
  for (const double one : {-1.0, 1.0}) {
    for (const double other : {-golden, golden}) {
      for (const auto& corner : {Eigen::Vector3d(0, one, other), Eigen::Vector3d(one, other, 0),
                                 Eigen::Vector3d(other, 0, one)}) {
        sides.emplace_back(box.center() + far * box.diagonal().norm() * corner.normalized());
      }
    }
  }
  return sides;
}

}  // namespace

std::vector<Viewpoint> viewpoints_of(Field sensors, const Eigen::AlignedBox3d& box) {
  std::vector<Viewpoint> from;
  const std::size_t every = (sensors.size() + most_views - 1) / most_views;
  for (std::size_t s = 0; s < sensors.size(); s += every) from.push_back({to_eigen(sensors[s]), s});
  if (!from.empty()) return from;
  for (const Eigen::Vector3d& side : all_sides(box)) from.push_back({side, from.size()});
  return from;
}

View::View(Field x, const Eigen::Vector3d& sensor, const Eigen::AlignedBox3d& box, double mean_edge,
           double pixels_of_edge)
    : sensor_(sensor) {
  axis_ = (box.center() - sensor).normalized();
  right_ = axis_.unitOrthogonal();
  up_ = axis_.cross(right_);
  Eigen::AlignedBox2d extent;
  double depth = 0;
  vertices_.reserve(x.size());
  for (const Vector3& position : x) {
    const Eigen::Vector3d arm = to_eigen(position) - sensor;
    const double z = std::max(arm.dot(axis_), 1e-3 * mean_edge);
    const Place place = {arm.dot(right_) / z, arm.dot(up_) / z, z};
    vertices_.push_back(place);
    extent.extend(Eigen::Vector2d(place[0], place[1]));
    depth += z;
  }
  depth /= static_cast<double>(x.size());
  const double pixel =
      std::max(mean_edge / (pixels_of_edge * depth), extent.sizes().maxCoeff() / pixels_across);
  if (!(pixel > 0) || !std::isfinite(pixel)) return;
  pixel_ = pixel;
  corner_ = extent.min();
  width_ = static_cast<std::ptrdiff_t>(extent.sizes()[0] / pixel) + 1;
  height_ = static_cast<std::ptrdiff_t>(extent.sizes()[1] / pixel) + 1;
  for (auto& [u, v, z] : vertices_) {
    u = (u - corner_[0]) / pixel;
    v = (v - corner_[1]) / pixel;
  }
}

View::Place View::place_of(const Vector3& position) const {
  const Eigen::Vector3d arm = to_eigen(position) - sensor_;
  const double z = arm.dot(axis_);
  if (!(z > 0)) return {0, 0, z};
  return {(arm.dot(right_) / z - corner_[0]) / pixel_, (arm.dot(up_) / z - corner_[1]) / pixel_, z};
}

}  // namespace dynmesh
