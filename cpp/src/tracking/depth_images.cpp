#include "tracking/depth_images.hpp"

#include <algorithm>
#include <cmath>

#include "support/geometry.hpp"

namespace dynmesh {
namespace {

/// How many pixels to each side of a vertex are looked at. Where the radius of the search is wider,
/// only every second, third ... pixel is, and then all around the best one.
constexpr int looks = 4;

}  // namespace

Vector3<double> Camera::to_camera(const Vector3<double>& point) const {
  const auto arm = point - position;
  return {dot(arm, axes[0]), dot(arm, axes[1]), dot(arm, axes[2])};
}

Vector3<double> Camera::from_camera(const Vector3<double>& local) const {
  return position + local.x * axes[0] + local.y * axes[1] + local.z * axes[2];
}

void DepthImages::clear() {
  images_.clear();
  depths_.clear();
  viewpoints_.clear();
  measured_.clear();
}

std::span<float> DepthImages::add(const Camera& camera, std::size_t height, std::size_t width) {
  images_.push_back({camera, height, width, depths_.size()});
  viewpoints_.push_back(camera.position);
  depths_.resize(depths_.size() + height * width);
  return std::span(depths_).last(height * width);
}

void DepthImages::prepare(double jump, Workers& workers) {
  points_.resize(depths_.size());
  normals_.resize(depths_.size());
  for (const Image& image : images_) {
    workers.for_each(static_cast<Index>(image.height), [&](Index row) {
      for (std::size_t column = 0; column < image.width; ++column) {
        const std::size_t pixel =
            image.first + static_cast<std::size_t>(row) * image.width + column;
        const auto depth = static_cast<double>(depths_[pixel]);
        if (!(depth > 0)) continue;
        const Camera& camera = image.camera;
        const double y = (static_cast<double>(row) - camera.cy) / camera.fy;
        const double x = (static_cast<double>(column) - camera.cx - camera.skew * y) / camera.fx;
        points_[pixel] = camera.from_camera({depth * x, depth * y, depth});
      }
    });
    workers.for_each(static_cast<Index>(image.height), [&](Index row) {
      const auto r = static_cast<std::size_t>(row);
      prepare_rows(image, jump, r, r + 1);
    });
  }
  measured_.clear();
  for (std::size_t pixel = 0; pixel < depths_.size(); ++pixel) {
    if (squared_norm(normals_[pixel]) > 0) measured_.push_back(static_cast<std::uint32_t>(pixel));
  }
}

/// Finds the normals of some rows.
void DepthImages::prepare_rows(const Image& image, double jump, std::size_t first_row,
                               std::size_t last_row) {
  for (std::size_t row = first_row; row < last_row; ++row) {
    for (std::size_t column = 0; column < image.width; ++column) {
      const std::size_t pixel = image.first + row * image.width + column;
      normals_[pixel] = {};
      if (row == 0 || row + 1 == image.height || column == 0 || column + 1 == image.width) continue;
      const float here = depths_[pixel];
      if (!(here > 0)) continue;
      const auto is_near = [&](std::size_t other) {
        return depths_[other] > 0 && std::abs(static_cast<double>(depths_[other] - here)) <= jump;
      };
      const std::size_t left = pixel - 1;
      const std::size_t right = pixel + 1;
      const std::size_t above = pixel - image.width;
      const std::size_t below = pixel + image.width;
      if (!is_near(left) || !is_near(right) || !is_near(above) || !is_near(below)) continue;
      auto normal = cross(points_[below] - points_[above], points_[right] - points_[left]);
      const double length = std::sqrt(squared_norm(normal));
      if (!(length > 0) || !std::isfinite(length)) continue;
      normal = (1 / length) * normal;
      const auto view = image.camera.position - points_[pixel];
      normals_[pixel] = dot(normal, view) < 0 ? -1.0 * normal : normal;
    }
  }
}

Correspondence DepthImages::nearest(const Vector3<double>& position, const Vector3<double>& normal,
                                    double radius, double agreement) const {
  double best = radius * radius;
  std::size_t found = depths_.size();
  for (const Image& image : images_) {
    const Camera& camera = image.camera;
    const auto local = camera.to_camera(position);
    if (!(local.z > 0)) continue;
    const double y = local.y / local.z;
    const double row = std::round(camera.fy * y + camera.cy);
    const double column = std::round(camera.fx * local.x / local.z + camera.skew * y + camera.cx);
    const double reach = std::ceil(radius * std::max(std::abs(camera.fx), std::abs(camera.fy)) /
                                   std::max(local.z - radius, 0.5 * local.z));
    const auto height = static_cast<double>(image.height);
    const auto width = static_cast<double>(image.width);
    if (!(row + reach >= 0 && row - reach < height && column + reach >= 0 &&
          column - reach < width)) {
      continue;
    }
    const double stride = std::max(1.0, std::ceil(reach / looks));
    const auto look = [&](double at_row, double at_column) {
      if (!(at_row >= 0 && at_row < height && at_column >= 0 && at_column < width)) return false;
      const std::size_t pixel = image.first + static_cast<std::size_t>(at_row) * image.width +
                                static_cast<std::size_t>(at_column);
      if (!(depths_[pixel] > 0)) return false;
      const double squared = squared_norm(points_[pixel] - position);
      if (!(squared < best) || !(dot(normals_[pixel], normal) >= agreement)) return false;
      if (squared_norm(normals_[pixel]) == 0) return false;
      best = squared;
      found = pixel;
      return true;
    };
    double best_row = row;
    double best_column = column;
    bool any = false;
    for (int i = -looks; i <= looks; ++i) {
      for (int j = -looks; j <= looks; ++j) {
        const double at_row = row + i * stride;
        const double at_column = column + j * stride;
        if (std::abs(i * stride) > reach || std::abs(j * stride) > reach) continue;
        if (!look(at_row, at_column)) continue;
        best_row = at_row;
        best_column = at_column;
        any = true;
      }
    }
    if (!any || stride == 1) continue;
    for (double i = 1 - stride; i < stride; ++i) {
      for (double j = 1 - stride; j < stride; ++j) look(best_row + i, best_column + j);
    }
  }
  if (found == depths_.size()) return {};
  return {points_[found], normals_[found], 1};
}

}  // namespace dynmesh
