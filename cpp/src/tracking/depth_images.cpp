#include "tracking/depth_images.hpp"

#include <algorithm>
#include <cmath>

#include "support/geometry.hpp"

namespace dynmesh {
namespace {

/// How many pixels to each side of a vertex are examined. Where the radius of the search is wider,
/// only every second, third ... pixel is, and then those around the best one, ever closer.
constexpr Index search_width = 4;

/// The least cosine between a normal and the view of a camera at which it would have seen the
/// surface, and of how many of 3 by 3 pixels it must have seen what is behind.
constexpr double least_frontal = 0.3;
constexpr int least_behind = 5;

}  // namespace

Vector3<double> Camera::to_camera(const Vector3<double>& point) const {
  const auto arm = point - position;
  return {dot(arm, axes[0]), dot(arm, axes[1]), dot(arm, axes[2])};
}

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
  viewpoints_.clear();
  ends_.clear();
  points_.clear();
  normals_.clear();
}

std::span<float> DepthImages::add(const Camera& camera, std::size_t height, std::size_t width) {
  images_.push_back({camera, height, width, depths_.size()});
  viewpoints_.push_back(camera.position);
  depths_.resize(depths_.size() + height * width);
  return std::span(depths_).last(height * width);
}

/// The points are stored without gaps, since most pixels measure nothing.
void DepthImages::prepare(double jump, Workers& workers) {
  numbers_.resize(depths_.size());
  std::size_t n_rows = 0;
  for (const Image& image : images_) n_rows += image.height;
  first_of_row_.assign(n_rows + 1, 0);
  std::size_t first_row = 0;
  for (const Image& image : images_) {
    workers.for_each(static_cast<Index>(image.height), [&](Index r) {
      const auto row = static_cast<std::size_t>(r);
      std::uint32_t n = 0;
      for (std::size_t column = 0; column < image.width; ++column) {
        const std::size_t pixel = image.first + row * image.width + column;
        const bool counts =
            depths_[pixel] > 0 && neighbours(image, row, column, jump).have_a_plane();
        numbers_[pixel] = counts ? n++ : no_guess;
      }
      first_of_row_[first_row + row + 1] = n;
    });
    first_row += image.height;
  }
  for (std::size_t row = 0; row < n_rows; ++row) first_of_row_[row + 1] += first_of_row_[row];
  points_.resize(first_of_row_[n_rows]);
  normals_.resize(first_of_row_[n_rows]);
  first_row = 0;
  for (const Image& image : images_) {
    workers.for_each(static_cast<Index>(image.height), [&](Index r) {
      const auto row = static_cast<std::size_t>(r);
      prepare_row(image, row, jump, first_of_row_[first_row + row]);
    });
    first_row += image.height;
    ends_.push_back(first_of_row_[first_row]);
  }
}

std::size_t DepthImages::sensor_of(std::size_t i) const {
  return static_cast<std::size_t>(std::ranges::upper_bound(ends_, i) - ends_.begin());
}

double DepthImages::squared_spacing(std::size_t i, std::size_t neighbours) const {
  const Image& image = images_[sensor_of(i)];
  const Camera& camera = image.camera;
  const auto local = camera.to_camera(points_[i]);
  const double y = local.y / local.z;
  const double row = std::round(camera.fy * y + camera.cy);
  const double column = std::round(camera.fx * local.x / local.z + camera.skew * y + camera.cx);
  std::vector<double> around;
  constexpr double width = 2;
  for (double r = row - width; r <= row + width; ++r) {
    for (double c = column - width; c <= column + width; ++c) {
      if (!(r >= 0 && r < static_cast<double>(image.height) && c >= 0 &&
            c < static_cast<double>(image.width))) {
        continue;
      }
      const std::uint32_t number =
          numbers_[image.first + static_cast<std::size_t>(r) * image.width +
                   static_cast<std::size_t>(c)];
      if (number == no_guess || number == i) continue;
      around.push_back(squared_norm(points_[number] - points_[i]));
    }
  }
  if (around.size() < neighbours) return std::numeric_limits<double>::infinity();
  const auto last = around.begin() + static_cast<std::ptrdiff_t>(neighbours) - 1;
  std::ranges::nth_element(around, last);
  return *last;
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

/// Finds the points and normals of a row, the first of which is number `first`.
void DepthImages::prepare_row(const Image& image, std::size_t row, double jump,
                              std::uint32_t first) {
  const Camera& camera = image.camera;
  const auto at = [&](std::size_t pixel) {
    const std::size_t offset = pixel - image.first;
    return camera.at(offset / image.width, offset % image.width,
                     static_cast<double>(depths_[pixel]));
  };
  for (std::size_t column = 0; column < image.width; ++column) {
    const std::size_t pixel = image.first + row * image.width + column;
    if (numbers_[pixel] == no_guess) continue;
    const std::uint32_t number = numbers_[pixel] += first;
    const auto around = neighbours(image, row, column, jump);
    points_[number] = at(pixel);
    const auto normal =
        cross(at(around.below) - at(around.above), at(around.right) - at(around.left));
    const double length = std::sqrt(squared_norm(normal));
    const bool is_plane = length > 0 && std::isfinite(length);
    const bool is_away = dot(normal, camera.position - points_[number]) < 0;
    normals_[number] = is_plane ? ((is_away ? -1 : 1) / length) * normal : Vector3<double>{};
  }
}

/// The search in one image, in the axes of its camera, since these need no memory but the depths.
class DepthImages::Search {
 public:
  double best;  // squared distance
  std::uint32_t found;
  Index found_row = 0;
  Index found_column = 0;

  Search(const DepthImages& images, const Image& image, const Vector3<double>& local,
         const Vector3<double>& normal, double agreement, double squared_distance,
         std::uint32_t found_before)
      : best(squared_distance),
        found(found_before),
        images_(images),
        image_(image),
        local_(local),
        normal_(normal),
        agreement_(agreement),
        found_before_(found_before) {}

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
        const std::uint32_t number = images_.numbers_[pixel];
        // In these axes the distance of the point found before would differ by rounding alone.
        if (number == no_guess || number == found_before_) continue;
        if (!(dot(images_.normals_[number], normal_) >= agreement_)) continue;
        if (squared_norm(images_.normals_[number]) == 0) continue;
        best = squared;
        found = number;
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
  std::uint32_t found_before_;
};

Correspondence DepthImages::nearest(const Vector3<double>& position, const Vector3<double>& normal,
                                    double radius, double agreement, std::uint32_t guess) const {
  double best = radius * radius;
  std::uint32_t found = no_guess;
  if (guess < points_.size() && dot(normals_[guess], normal) >= agreement) {
    const double squared = squared_norm(points_[guess] - position);
    if (squared < best) {
      best = squared;
      found = guess;
    }
  }
  for (const Image& image : images_) {
    const Camera& camera = image.camera;
    if (!(dot(normal, camera.position - position) > 0)) continue;
    const auto local = camera.to_camera(position);
    if (!(local.z > 0)) continue;
    const double y = local.y / local.z;
    const double row = std::round(camera.fy * y + camera.cy);
    const double column = std::round(camera.fx * local.x / local.z + camera.skew * y + camera.cx);
    const double size = static_cast<double>(std::max(image.height, image.width));
    const auto reach_of = [&](double distance) {
      return std::min(size, std::ceil(distance * std::max(camera.fx, camera.fy) /
                                      std::max(local.z - distance, 0.5 * local.z)));
    };
    const double reach = reach_of(std::sqrt(best));
    if (!(row + reach >= 0 && row - reach < size && column + reach >= 0 && column - reach < size)) {
      continue;
    }
    Search search(*this, image, local, normal, agreement, best, found);
    const auto r = static_cast<Index>(row);
    const auto c = static_cast<Index>(column);
    const bool is_centre = search.look_around(r, c, 0, 1);
    const auto width = static_cast<Index>(is_centre ? reach_of(std::sqrt(search.best)) : reach);
    const Index stride = std::max(Index{1}, (width + search_width - 1) / search_width);
    if (!search.look_around(r, c, std::min(search_width, width), stride) && !is_centre) continue;
    for (Index finer = stride / 2; finer > 0; finer /= 2) {
      search.look_around(search.found_row, search.found_column, 1, finer);
    }
    best = search.best;
    found = search.found;
  }
  if (found == no_guess) return {};
  return {points_[found], normals_[found], 1, found};
}

bool DepthImages::is_free(const Vector3<double>& position, const Vector3<double>& normal,
                          double margin) const {
  return std::ranges::any_of(images_, [&](const Image& image) {
    const auto view = image.camera.position - position;
    const double ahead = dot(normal, view);
    return ahead * ahead > least_frontal * least_frontal * squared_norm(view) &&
           is_free_in(image, position, margin);
  });
}

bool DepthImages::is_free_in(const Image& image, const Vector3<double>& position,
                             double margin) const {
  const Camera& camera = image.camera;
  const auto local = camera.to_camera(position);
  if (!(local.z > 0)) return false;
  const double y = local.y / local.z;
  const double row = std::round(camera.fy * y + camera.cy);
  const double column = std::round(camera.fx * local.x / local.z + camera.skew * y + camera.cx);
  if (!(row >= 1 && row + 1 < static_cast<double>(image.height) && column >= 1 &&
        column + 1 < static_cast<double>(image.width))) {
    return false;
  }
  const float* pixel = &depths_[image.first + static_cast<std::size_t>(row) * image.width +
                                static_cast<std::size_t>(column)];
  if (*pixel == 0) return false;
  const double least = local.z + margin;
  const auto width = static_cast<std::ptrdiff_t>(image.width);
  int n_behind = 0;
  for (const std::ptrdiff_t line : {std::ptrdiff_t{0}, -width, width}) {
    for (const std::ptrdiff_t aside : {0, -1, 1}) {
      const auto depth = static_cast<double>(pixel[line + aside]);
      if (depth == 0) continue;
      if (depth < least) return false;
      ++n_behind;
    }
  }
  return n_behind >= least_behind;
}

}  // namespace dynmesh
