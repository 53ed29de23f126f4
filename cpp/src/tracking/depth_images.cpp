#include "tracking/depth_images.hpp"

#include <algorithm>
#include <cmath>

#include "support/geometry.hpp"

namespace dynmesh {
namespace {

/// How many pixels to each side of a vertex are looked at. Where the radius of the search is wider,
/// only every second, third ... pixel is, and then those around the best one, ever closer.
constexpr Index looks = 4;

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

/// The search in one image, in the axes of its camera, since these need no memory but the depths.
class DepthImages::Search {
 public:
  Search(const DepthImages& images, const Image& image, const Vector3<double>& local,
         const Vector3<double>& normal, double agreement, double squared_distance)
      : images_(images),
        image_(image),
        local_(local),
        normal_(normal),
        agreement_(agreement),
        best(squared_distance) {}

  /// Looks at the pixels up to `steps` strides around one. Returns whether a nearer point was
  /// found.
  bool look_around(Index row, Index column, Index steps, Index stride) {
    const Camera& camera = image_.camera;
    const auto height = static_cast<Index>(image_.height);
    const auto width = static_cast<Index>(image_.width);
    bool any = false;
    for (Index i = -steps; i <= steps; ++i) {
      const Index r = row + i * stride;
      if (r < 0 || r >= height) continue;
      const double y = (r - camera.cy) / camera.fy;
      const std::size_t first = image_.first + static_cast<std::size_t>(r) * image_.width;
      for (Index j = -steps; j <= steps; ++j) {
        const Index c = column + j * stride;
        if (c < 0 || c >= width) continue;
        const std::size_t pixel = first + static_cast<std::size_t>(c);
        const auto depth = static_cast<double>(images_.depths_[pixel]);
        const double ahead = depth - local_.z;
        if (depth == 0 || !(ahead * ahead < best)) continue;
        const double right = depth * (c - camera.cx - camera.skew * y) / camera.fx - local_.x;
        const double down = depth * y - local_.y;
        const double squared = right * right + down * down + ahead * ahead;
        if (!(squared < best)) continue;
        const auto& normal = images_.normals_[pixel];
        if (!(dot(normal, normal_) >= agreement_) || squared_norm(normal) == 0) continue;
        best = squared;
        found = pixel;
        found_row = r;
        found_column = c;
        any = true;
      }
    }
    return any;
  }

 private:
  const DepthImages& images_;
  const Image& image_;
  const Vector3<double>& local_;
  const Vector3<double>& normal_;
  double agreement_;

 public:
  double best;  // squared distance
  std::size_t found = 0;
  Index found_row = 0;
  Index found_column = 0;
};

Correspondence DepthImages::nearest(const Vector3<double>& position, const Vector3<double>& normal,
                                    double radius, double agreement) const {
  double best = radius * radius;
  std::size_t found = depths_.size();
  for (const Image& image : images_) {
    const Camera& camera = image.camera;
    const auto local = camera.to_camera(position);
    if (!(local.z > 0) || !(dot(normal, camera.position - position) > 0)) continue;
    const double y = local.y / local.z;
    const double row = std::round(camera.fy * y + camera.cy);
    const double column = std::round(camera.fx * local.x / local.z + camera.skew * y + camera.cx);
    const double size = static_cast<double>(std::max(image.height, image.width));
    const double reach = std::min(size, std::ceil(radius * std::max(camera.fx, camera.fy) /
                                                  std::max(local.z - radius, 0.5 * local.z)));
    if (!(row + reach >= 0 && row - reach < size && column + reach >= 0 && column - reach < size)) {
      continue;
    }
    const auto width = static_cast<Index>(reach);
    const Index stride = std::max(Index{1}, (width + looks - 1) / looks);
    Search search(*this, image, local, normal, agreement, best);
    if (!search.look_around(static_cast<Index>(row), static_cast<Index>(column),
                            std::min(looks, width), stride)) {
      continue;
    }
    for (Index finer = stride / 2; finer > 0; finer /= 2) {
      search.look_around(search.found_row, search.found_column, 1, finer);
    }
    best = search.best;
    found = search.found;
  }
  if (found == depths_.size()) return {};
  return {points_[found], normals_[found], 1};
}

}  // namespace dynmesh
