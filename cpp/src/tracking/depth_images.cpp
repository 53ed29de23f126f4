#include "tracking/depth_images.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "support/geometry.hpp"

namespace dynmesh {

Vector3<double> Camera::from_camera(const Vector3<double>& local) const {
  return position + local.x * axes[0] + local.y * axes[1] + local.z * axes[2];
}

Vector3<double> Camera::at(std::size_t row, std::size_t column, double depth) const {
  const double y = (static_cast<double>(row) - cy) / fy;
  const double x = (static_cast<double>(column) - cx - skew * y) / fx;
  return from_camera({depth * x, depth * y, depth});
}

void DepthImages::clear() {
  images_.clear();
  depths_.clear();
}

std::span<float> DepthImages::add(const Camera& camera, std::size_t height, std::size_t width) {
  images_.push_back({camera, height, width, depths_.size()});
  depths_.resize(depths_.size() + height * width);
  return std::span(depths_).last(height * width);
}

DepthImages::Neighbours DepthImages::neighbours(const Image& image, std::size_t row,
                                                std::size_t column, double jump) const {
  const std::size_t pixel = image.first + row * image.width + column;
  const float here = depths_[pixel];
  const auto near = [&](bool is_inside, std::size_t other) {
    const bool is_near = is_inside && depths_[other] > 0 &&
                         std::abs(static_cast<double>(depths_[other] - here)) <= jump;
    return is_near ? other : pixel;
  };
  return {near(column > 0, pixel - 1), near(column + 1 < image.width, pixel + 1),
          near(row > 0, pixel - image.width), near(row + 1 < image.height, pixel + image.width)};
}

/// The points are stored without gaps, since most pixels measure nothing: each row is counted
/// first.
void DepthImages::convert(double jump, std::size_t most, Workers& workers, PointScan& scan) const {
  const auto measured =
      static_cast<double>(std::ranges::count_if(depths_, [](float depth) { return depth > 0; }));
  const auto step = static_cast<std::size_t>(
      std::max(1.0, std::floor(std::sqrt(measured / static_cast<double>(most)))));
  struct Row {
    const Image* image;
    std::uint32_t sensor;
    std::size_t row;
    std::size_t first;  // of its points
  };
  std::vector<Row> rows;
  scan.sensors.clear();
  for (const Image& image : images_) {
    for (std::size_t r = 0; r < image.height; r += step) {
      rows.push_back({&image, static_cast<std::uint32_t>(scan.sensors.size()), r, 0});
    }
    scan.sensors.push_back(image.camera.position);
  }
  const auto visit = [&](const Row& row, const auto& work) {
    for (std::size_t column = 0; column < row.image->width; column += step) {
      if (!(depths_[row.image->first + row.row * row.image->width + column] > 0)) continue;
      const auto around = neighbours(*row.image, row.row, column, jump);
      if (around.have_a_plane()) work(column, around);
    }
  };
  workers.for_each_in_chunks(rows.size(), [&](std::size_t r) {
    visit(rows[r], [&](std::size_t, const Neighbours&) { ++rows[r].first; });
  });
  std::size_t n = 0;
  for (Row& row : rows) n += std::exchange(row.first, n);
  scan.points.resize(n);
  scan.normals.resize(n);
  scan.sensor_numbers.resize(n);
  scan.undecided.clear();
  workers.for_each_in_chunks(rows.size(), [&](std::size_t r) {
    const Row& row = rows[r];
    const Camera& camera = row.image->camera;
    const auto at = [&](std::size_t pixel) {
      const std::size_t offset = pixel - row.image->first;
      return camera.at(offset / row.image->width, offset % row.image->width,
                       static_cast<double>(depths_[pixel]));
    };
    std::size_t i = row.first;
    visit(row, [&](std::size_t column, const Neighbours& around) {
      scan.points[i] = at(row.image->first + row.row * row.image->width + column);
      const auto normal =
          cross(at(around.below) - at(around.above), at(around.right) - at(around.left));
      const double length = std::sqrt(squared_norm(normal));
      const bool is_plane = length > 0 && std::isfinite(length);
      const bool is_away = dot(normal, camera.position - scan.points[i]) < 0;
      scan.normals[i] = is_plane ? ((is_away ? -1 : 1) / length) * normal : Vector3<double>{};
      scan.sensor_numbers[i] = row.sensor;
      ++i;
    });
  });
  scan.forget_index();
}

}  // namespace dynmesh
