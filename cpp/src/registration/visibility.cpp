#include "registration/visibility.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "support/geometry.hpp"

namespace dynmesh {
namespace {

/// Unit vectors to the right, down and ahead.
struct Axes {
  Vector3<double> right, down, ahead;

  explicit Axes(const Vector3<double>& view) {
    ahead = (1 / std::sqrt(squared_norm(view))) * view;
    const double x = std::abs(ahead.x);
    const double y = std::abs(ahead.y);
    const double z = std::abs(ahead.z);
    const Vector3<double> other = {x <= y && x <= z ? 1.0 : 0.0, y < x && y <= z ? 1.0 : 0.0,
                                   z < x && z < y ? 1.0 : 0.0};
    right = cross(ahead, other);
    right = (1 / std::sqrt(squared_norm(right))) * right;
    down = cross(ahead, right);
  }
};

}  // namespace

Visibility::Visibility(std::size_t n_vertices)
    : image_(n_vertices), depths_(std::size_t{most_pixels} * most_pixels) {}

void Visibility::find(std::span<const Triangle> faces, Field frame, Field normals, Field viewpoints,
                      std::span<const std::uint8_t> is_sheet, const Tolerances& tolerances,
                      std::span<Sight> seen) {
  std::ranges::fill(seen, viewpoints.empty() ? Sight::front : Sight::hidden);
  Vector3<double> low = frame[0];
  Vector3<double> high = frame[0];
  for (const auto& x : frame) {
    low = {std::min(low.x, x.x), std::min(low.y, x.y), std::min(low.z, x.z)};
    high = {std::max(high.x, x.x), std::max(high.y, x.y), std::max(high.z, x.z)};
  }
  const auto centre = 0.5 * (low + high);
  const double reach = 0.5 * std::sqrt(squared_norm(high - low));
  for (const auto& viewpoint : viewpoints) {
    const auto view = centre - viewpoint;
    const double distance = std::sqrt(squared_norm(view));
    const bool is_outside = distance > 1.01 * reach;
    double scale = 0;
    double half = 0;
    if (is_outside) {
      // The sphere around the surface appears under the half-angle asin(reach / distance).
      const double slope = reach / std::sqrt(distance * distance - reach * reach);
      half = std::clamp(std::ceil(slope * distance / tolerances.pixel), 2.0, 0.5 * most_pixels);
      scale = (half - 1) / slope;
      const Axes axes(view);
      for (std::size_t v = 0; v < frame.size(); ++v) {
        const auto arm = frame[v] - viewpoint;
        const double depth = dot(arm, axes.ahead);
        image_[v] = {half + scale * dot(arm, axes.right) / depth,
                     half + scale * dot(arm, axes.down) / depth, depth};
      }
      draw(faces, static_cast<int>(2 * half));
    }
    const int side = static_cast<int>(2 * half);
    for (std::size_t v = 0; v < frame.size(); ++v) {
      if (seen[v] == Sight::both || (seen[v] == Sight::front && is_sheet[v] == 0)) continue;
      const bool is_front = dot(normals[v], viewpoint - frame[v]) > 0;
      if (!is_front && !(is_sheet[v] != 0 && is_outside)) continue;
      if (is_outside) {
        const int column = std::clamp(static_cast<int>(image_[v].x), 0, side - 1);
        const int row = std::clamp(static_cast<int>(image_[v].y), 0, side - 1);
        const auto drawn =
            static_cast<double>(depths_[static_cast<std::size_t>(row * side + column)]);
        // Outside of all that is drawn, a back is that of a rim, which is seen from the side.
        if (!is_front && !std::isfinite(drawn)) continue;
        if (image_[v].z > drawn + (is_front ? tolerances.front : tolerances.back)) continue;
      }
      const Sight of_this = is_front ? Sight::front : Sight::back;
      seen[v] = seen[v] == Sight::hidden || seen[v] == of_this ? of_this : Sight::both;
    }
  }
}

/// Draws the depths of the faces at the centres of the pixels.
void Visibility::draw(std::span<const Triangle> faces, int side) {
  std::fill_n(depths_.begin(), side * side, std::numeric_limits<float>::infinity());
  for (const Triangle& face : faces) {
    const auto& a = image_[static_cast<std::size_t>(face[0])];
    const auto& b = image_[static_cast<std::size_t>(face[1])];
    const auto& c = image_[static_cast<std::size_t>(face[2])];
    const double area = (b.x - a.x) * (c.y - a.y) - (b.y - a.y) * (c.x - a.x);
    if (area == 0 || !std::isfinite(area)) continue;
    // The image contains all of the surface, so these are at least 0.
    const auto next_centre = [&](double x) { return std::min(side, static_cast<int>(x + 0.5)); };
    const int left = next_centre(std::min({a.x, b.x, c.x}));
    const int right = next_centre(std::max({a.x, b.x, c.x}));
    const int top = next_centre(std::min({a.y, b.y, c.y}));
    const int bottom = next_centre(std::max({a.y, b.y, c.y}));
    const double per_area = 1 / area;
    for (int row = top; row < bottom; ++row) {
      for (int column = left; column < right; ++column) {
        const double x = column + 0.5;
        const double y = row + 0.5;
        const double u = per_area * ((b.x - x) * (c.y - y) - (b.y - y) * (c.x - x));
        const double v = per_area * ((c.x - x) * (a.y - y) - (c.y - y) * (a.x - x));
        const double w = 1 - u - v;
        if (u < 0 || v < 0 || w < 0) continue;
        const auto depth = static_cast<float>(u * a.z + v * b.z + w * c.z);
        float& drawn = depths_[static_cast<std::size_t>(row * side + column)];
        drawn = std::min(drawn, depth);
      }
    }
  }
}

}  // namespace dynmesh
