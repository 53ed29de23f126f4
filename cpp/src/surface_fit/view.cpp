#include "surface_fit/view.hpp"

#include <algorithm>
#include <cmath>

#include "base/geometry.hpp"
#include "base/rigid_motion.hpp"

namespace dynmesh {
namespace {

constexpr double pixels_of_edge = 2;
constexpr double pixels_across = 640;  // at most, in each direction
/// What lies before a vertex by less than this many mean edges does not hide it.
constexpr double least_gap = 0.1;
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

std::vector<Viewpoint> drawn_from(Field sensors, const Eigen::AlignedBox3d& box) {
  std::vector<Viewpoint> from;
  const std::size_t every = (sensors.size() + most_views - 1) / most_views;
  for (std::size_t s = 0; s < sensors.size(); s += every) from.push_back({to_eigen(sensors[s]), s});
  if (!from.empty()) return from;
  for (const Eigen::Vector3d& side : all_sides(box)) from.push_back({side, from.size()});
  return from;
}

View::View(std::span<const Triangle> faces, std::span<const Index> component, Field x,
           const Eigen::Vector3d& sensor, const Eigen::AlignedBox3d& box, double mean_edge)
    : component_(component), sensor_(sensor), mean_edge_(mean_edge) {
  axis_ = (box.center() - sensor).normalized();
  right_ = axis_.unitOrthogonal();
  up_ = axis_.cross(right_);
  Eigen::AlignedBox2d extent;
  double depth = 0;
  corners_.reserve(x.size());
  for (const Vector3& position : x) {
    const Eigen::Vector3d arm = to_eigen(position) - sensor;
    const double z = std::max(arm.dot(axis_), 1e-3 * mean_edge);
    corners_.push_back({arm.dot(right_) / z, arm.dot(up_) / z, z});
    extent.extend(Eigen::Vector2d(corners_.back()[0], corners_.back()[1]));
    depth += z / static_cast<double>(x.size());
  }
  const double pixel =
      std::max(mean_edge / (pixels_of_edge * depth), extent.sizes().maxCoeff() / pixels_across);
  if (!(pixel > 0) || !std::isfinite(pixel)) return;  // a surface without extent hides nothing
  pixel_ = pixel;
  corner_ = extent.min();
  width_ = static_cast<std::ptrdiff_t>(extent.sizes()[0] / pixel) + 1;
  height_ = static_cast<std::ptrdiff_t>(extent.sizes()[1] / pixel) + 1;
  nearest_.resize(static_cast<std::size_t>(width_ * height_));
  for (auto& [u, v, z] : corners_) {
    u = (u - extent.min()[0]) / pixel;
    v = (v - extent.min()[1]) / pixel;
  }
  for (const Triangle& face : faces) draw(face);
}

const View::Pixel& View::pixel_at(std::size_t vertex) const {
  const auto& [u, v, z] = corners_[vertex];
  return nearest_[static_cast<std::size_t>(static_cast<std::ptrdiff_t>(v) * width_ +
                                           static_cast<std::ptrdiff_t>(u))];
}

bool View::hides(std::size_t vertex) const {
  if (nearest_.empty()) return false;
  const auto& [depth, component] = pixel_at(vertex);
  return component != -1 && component != component_[vertex] &&
         depth < corners_[vertex][2] - least_gap * mean_edge_;
}

bool View::covers(std::size_t vertex, double distance) const {
  return !nearest_.empty() && pixel_at(vertex).depth < corners_[vertex][2] - distance;
}

void View::count(std::span<double> pixels) const {
  for (const Pixel& pixel : nearest_) {
    if (pixel.component != -1) pixels[at(pixel.component)] += 1;
  }
}

View::Place View::place_of(const Vector3& position) const {
  const Eigen::Vector3d arm = to_eigen(position) - sensor_;
  const double z = arm.dot(axis_);
  if (!(z > 0)) return {0, 0, z};
  return {(arm.dot(right_) / z - corner_[0]) / pixel_, (arm.dot(up_) / z - corner_[1]) / pixel_, z};
}

void View::draw(const Triangle& face) {
  const auto& a = corners_[at(face[0])];
  const auto& b = corners_[at(face[1])];
  const auto& c = corners_[at(face[2])];
  const double area = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
  if (area == 0) return;
  // Of the shares of b and c, where the pixel moves by one along a row and a column.
  const double scale = 1 / area;
  const double b_along = scale * (c[1] - a[1]);
  const double b_across = -scale * (c[0] - a[0]);
  const double c_along = -scale * (b[1] - a[1]);
  const double c_across = scale * (b[0] - a[0]);
  const auto first = [](double p, double q, double r) {
    return static_cast<std::ptrdiff_t>(std::ceil(std::min({p, q, r}) - 0.5));
  };
  const auto last = [](double p, double q, double r) {
    return static_cast<std::ptrdiff_t>(std::floor(std::max({p, q, r}) - 0.5));
  };
  const Index component = component_.empty() ? 0 : component_[at(face[0])];
  const std::ptrdiff_t end_u = last(a[0], b[0], c[0]);
  const std::ptrdiff_t end_v = last(a[1], b[1], c[1]);
  for (std::ptrdiff_t v = first(a[1], b[1], c[1]); v <= end_v; ++v) {
    for (std::ptrdiff_t u = first(a[0], b[0], c[0]); u <= end_u; ++u) {
      const double from_u = static_cast<double>(u) + 0.5 - a[0];
      const double from_v = static_cast<double>(v) + 0.5 - a[1];
      const double share_b = from_u * b_along + from_v * b_across;
      const double share_c = from_u * c_along + from_v * c_across;
      if (share_b < 0 || share_c < 0 || share_b + share_c > 1) continue;
      const double depth = a[2] + share_b * (b[2] - a[2]) + share_c * (c[2] - a[2]);
      Pixel& pixel = nearest_[static_cast<std::size_t>(v * width_ + u)];
      if (depth < pixel.depth) pixel = {depth, component};
    }
  }
}

}  // namespace dynmesh
