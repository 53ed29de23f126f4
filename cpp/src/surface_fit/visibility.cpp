#include "surface_fit/visibility.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "base/geometry.hpp"
#include "base/rigid_motion.hpp"

namespace dynmesh {
namespace {

constexpr double pixels_of_edge = 2;
constexpr double pixels_across = 640;  // at most, in each direction
/// Of more sensors, so many are used, evenly chosen: they surround the surface.
constexpr std::size_t most_views = 24;
/// What lies before a vertex by less than this many mean edges does not hide it.
constexpr double least_gap = 0.1;

/// The surface as one sensor sees it: of each pixel, what is nearest.
class View {
 public:
  View(std::span<const Triangle> faces, std::span<const Index> component, Field x,
       const Eigen::Vector3d& sensor, const Eigen::AlignedBox3d& box, double mean_edge)
      : component_(component), gap_(least_gap * mean_edge) {
    const Eigen::Vector3d axis = (box.center() - sensor).normalized();
    const Eigen::Vector3d right = axis.unitOrthogonal();
    const Eigen::Vector3d up = axis.cross(right);
    Eigen::AlignedBox2d extent;
    double depth = 0;
    for (const Vector3& position : x) {
      const Eigen::Vector3d arm = to_eigen(position) - sensor;
      const double z = std::max(arm.dot(axis), 1e-3 * mean_edge);
      corners_.push_back({arm.dot(right) / z, arm.dot(up) / z, z});
      extent.extend(Eigen::Vector2d(corners_.back()[0], corners_.back()[1]));
      depth += z / static_cast<double>(x.size());
    }
    const double pixel =
        std::max(mean_edge / (pixels_of_edge * depth), extent.sizes().maxCoeff() / pixels_across);
    if (!(pixel > 0) || !std::isfinite(pixel)) return;  // a surface without extent hides nothing
    width_ = static_cast<std::ptrdiff_t>(extent.sizes()[0] / pixel) + 1;
    const auto height = static_cast<std::ptrdiff_t>(extent.sizes()[1] / pixel) + 1;
    nearest_.assign(static_cast<std::size_t>(width_ * height),
                    {std::numeric_limits<double>::infinity(), -1});
    for (auto& [u, v, z] : corners_) {
      u = (u - extent.min()[0]) / pixel;
      v = (v - extent.min()[1]) / pixel;
    }
    for (const Triangle& face : faces) draw(face);
  }

  /// Whether another component lies before a vertex.
  [[nodiscard]] bool hides(std::size_t vertex) const {
    if (nearest_.empty()) return false;
    const auto& [u, v, z] = corners_[vertex];
    const auto& [depth, component] = nearest_[static_cast<std::size_t>(
        static_cast<std::ptrdiff_t>(v) * width_ + static_cast<std::ptrdiff_t>(u))];
    return component != -1 && component != component_[vertex] && depth < z - gap_;
  }

  /// Adds the number of its pixels to each component.
  void count(std::span<double> pixels) const {
    for (const Pixel& pixel : nearest_) {
      if (pixel.component != -1) pixels[at(pixel.component)] += 1;
    }
  }

 private:
  struct Pixel {
    double depth;
    Index component;
  };

  void draw(const Triangle& face) {
    const auto& a = corners_[at(face[0])];
    const auto& b = corners_[at(face[1])];
    const auto& c = corners_[at(face[2])];
    const double area = (b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0]);
    if (area == 0) return;
    const auto first = [](double p, double q, double r) {
      return static_cast<std::ptrdiff_t>(std::ceil(std::min({p, q, r}) - 0.5));
    };
    const auto last = [](double p, double q, double r) {
      return static_cast<std::ptrdiff_t>(std::floor(std::max({p, q, r}) - 0.5));
    };
    const std::ptrdiff_t end_u = last(a[0], b[0], c[0]);
    const std::ptrdiff_t end_v = last(a[1], b[1], c[1]);
    for (std::ptrdiff_t v = first(a[1], b[1], c[1]); v <= end_v; ++v) {
      for (std::ptrdiff_t u = first(a[0], b[0], c[0]); u <= end_u; ++u) {
        const double pu = static_cast<double>(u) + 0.5;
        const double pv = static_cast<double>(v) + 0.5;
        const double share_b = ((pu - a[0]) * (c[1] - a[1]) - (pv - a[1]) * (c[0] - a[0])) / area;
        const double share_c = ((b[0] - a[0]) * (pv - a[1]) - (b[1] - a[1]) * (pu - a[0])) / area;
        if (share_b < 0 || share_c < 0 || share_b + share_c > 1) continue;
        const double depth = a[2] + share_b * (b[2] - a[2]) + share_c * (c[2] - a[2]);
        Pixel& pixel = nearest_[static_cast<std::size_t>(v * width_ + u)];
        if (depth < pixel.depth) pixel = {depth, component_[at(face[0])]};
      }
    }
  }

  std::span<const Index> component_;
  double gap_;
  std::vector<std::array<double, 3>> corners_;  // in pixels, and the depth
  std::ptrdiff_t width_ = 0;
  std::vector<Pixel> nearest_;
};

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

Visibility find_visibility(std::span<const Triangle> faces, std::span<const Index> component,
                           Field x, Field normals, std::span<const std::uint8_t> is_sheet,
                           Field sensors, double mean_edge, Workers& workers) {
  const std::size_t k = x.size();
  Eigen::AlignedBox3d box;
  for (const Vector3& position : x) box.extend(to_eigen(position));
  std::vector<Eigen::Vector3d> from;
  const std::size_t every = (sensors.size() + most_views - 1) / most_views;
  for (std::size_t s = 0; s < sensors.size(); s += every) from.push_back(to_eigen(sensors[s]));
  if (from.empty()) from = all_sides(box);
  constexpr std::uint8_t faces_it = 1;
  constexpr std::uint8_t sees_it = 2;
  std::vector<std::vector<std::uint8_t>> views(from.size());
  std::vector<std::vector<double>> pixels(from.size());
  const Index last = component.empty() ? -1 : *std::ranges::max_element(component);
  workers.for_each_in_chunks(
      from.size(),
      [&](std::size_t s) {
        views[s].resize(k);
        const bool is_inside = box.contains(from[s]);
        const View* view = nullptr;
        std::vector<View> made;
        if (!is_inside) view = &made.emplace_back(faces, component, x, from[s], box, mean_edge);
        pixels[s].resize(at(last + 1));
        if (view != nullptr) view->count(pixels[s]);
        for (std::size_t v = 0; v < k; ++v) {
          const auto towards = from_eigen(from[s]) - x[v];
          if (is_sheet[v] == 0 && !(dot(normals[v], towards) > 0)) continue;
          views[s][v] = faces_it;
          if (view == nullptr || !view->hides(v)) views[s][v] |= sees_it;
        }
      },
      static_cast<Index>(k));
  Visibility found{std::vector<std::uint8_t>(k), {}, {}};
  std::vector<std::uint8_t> is_hidden(k);
  for (std::size_t v = 0; v < k; ++v) {
    std::uint8_t any = 0;
    for (const auto& view : views) any |= view[v];
    is_hidden[v] = any == faces_it ? 1 : 0;
    found.is_seen[v] = (any & sees_it) != 0 ? 1 : 0;
  }
  for (const Triangle& face : faces) {
    const auto hides = [&](Index v) { return is_hidden[at(v)] != 0; };
    found.is_hidden.push_back(std::ranges::all_of(face, hides) ? 1 : 0);
  }
  found.shares.resize(at(last + 1));
  double sum = 0;
  for (const auto& counted : pixels) {
    for (std::size_t c = 0; c < counted.size(); ++c) {
      found.shares[c] += counted[c];
      sum += counted[c];
    }
  }
  for (double& share : found.shares) share = sum > 0 ? share / sum : 0;
  return found;
}

}  // namespace dynmesh
