#include "quality/sight.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <limits>
#include <span>

#include "base/geometry.hpp"
#include "base/rigid_motion.hpp"
#include "quality/limits.hpp"
#include "surface_fit/view.hpp"

namespace dynmesh {
namespace {

constexpr double pixels_of_edge = 1;
/// A triangle that is no larger is drawn as its middle, and a larger one as those of its parts, so
/// that hardly a pixel of the surface has none.
constexpr double pixels_of_middle = 1;
/// A surface that is turned away farther is seen so flatly that sensors may miss it.
constexpr double least_facing = 0.35;
/// Fewer points around a line of sight tell nothing of it.
constexpr int fewest_on_line = 3;

/// What is nearest to a sensor, in cells of its image and one around that.
class Depths {
 public:
  struct Cell {
    double nearest = std::numeric_limits<double>::infinity();
    int count = 0;
  };

  /// Cells are so many pixels wide.
  Depths(const View& view, double cell)
      : cell_(cell),
        columns_(static_cast<std::ptrdiff_t>(static_cast<double>(view.width()) / cell) + 3) {
    const auto rows = static_cast<std::ptrdiff_t>(static_cast<double>(view.height()) / cell) + 3;
    cells_.resize(static_cast<std::size_t>(columns_ * rows));
  }

  void add(const View::Place& place) {
    Cell& cell = cells_[number_of(place)];
    cell.nearest = std::min(cell.nearest, place[2]);
    ++cell.count;
  }
  /// At a place of the image, and there and in the cells around it.
  [[nodiscard]] const Cell& at(const View::Place& place) const { return cells_[number_of(place)]; }
  [[nodiscard]] Cell around(const View::Place& place) const {
    Cell found;
    const auto middle = static_cast<std::ptrdiff_t>(number_of(place));
    for (std::ptrdiff_t row = -1; row <= 1; ++row) {
      for (std::ptrdiff_t column = -1; column <= 1; ++column) {
        const Cell& cell = cells_[static_cast<std::size_t>(middle + row * columns_ + column)];
        found.nearest = std::min(found.nearest, cell.nearest);
        found.count += cell.count;
      }
    }
    return found;
  }
  [[nodiscard]] double cell() const { return cell_; }

 private:
  [[nodiscard]] std::size_t number_of(const View::Place& place) const {
    const auto row = static_cast<std::ptrdiff_t>(place[1] / cell_) + 1;
    const auto column = static_cast<std::ptrdiff_t>(place[0] / cell_) + 1;
    return static_cast<std::size_t>(row * columns_ + column);
  }

  double cell_;
  std::ptrdiff_t columns_;
  std::vector<Cell> cells_;
};

/// Draws a triangle as some of its points.
void draw(const View& view, const Triangle& face, Depths& depths) {
  const View::Place& a = view.place_of(at(face[0]));
  const View::Place& b = view.place_of(at(face[1]));
  const View::Place& c = view.place_of(at(face[2]));
  const auto extent = [&](std::size_t i) {
    return std::max({a[i], b[i], c[i]}) - std::min({a[i], b[i], c[i]});
  };
  const int n = 1 + static_cast<int>(std::max(extent(0), extent(1)) / pixels_of_middle);
  for (int i = 0; i < n; ++i) {
    for (int j = 0; j < n - i; ++j) {
      const double share_b = (i + 1.0 / 3) / n;
      const double share_c = (j + 1.0 / 3) / n;
      const double share_a = 1 - share_b - share_c;
      depths.add({share_a * a[0] + share_b * b[0] + share_c * c[0],
                  share_a * a[1] + share_b * b[1] + share_c * c[1],
                  share_a * a[2] + share_b * b[2] + share_c * c[2]});
    }
  }
}

/// What a sensor measured, in cells as large as an edge at least, and as the distances between
/// points.
Depths measured_depths(const View& view, const PointScan& scan,
                       std::span<const std::uint32_t> numbers) {
  std::vector<View::Place> places;
  const auto across = static_cast<double>(view.width());
  const auto down = static_cast<double>(view.height());
  for (const std::uint32_t i : numbers) {
    const View::Place place = view.place_of(scan.points[i]);
    const bool is_within =
        place[2] > 0 && place[0] >= 0 && place[0] < across && place[1] >= 0 && place[1] < down;
    if (is_within) places.push_back(place);
  }
  const double spacing =
      std::sqrt(across * down / std::max(1.0, static_cast<double>(places.size())));
  Depths depths(view, std::max(pixels_of_edge, spacing));
  for (const View::Place& place : places) depths.add(place);
  return depths;
}

}  // namespace

Sight sight_of(const BentSurface& surface, const PointScan& scan,
               std::span<const std::uint8_t> is_measured, double noise,
               const SightSettings& settings, Workers& workers) {
  const std::size_t k = surface.x.size();
  Sight sight{{is_measured.begin(), is_measured.end()},
              std::vector<std::uint8_t>(k),
              std::vector<std::uint8_t>(k)};
  if (scan.sensors.empty() && !settings.without_sensors.empty()) {
    for (std::size_t v = 0; v < k; ++v) sight.seen[v] |= settings.without_sensors[v];
    std::ranges::copy(settings.without_sensors, sight.faced.begin());
    return sight;
  }
  Eigen::AlignedBox3d box;
  for (const Vector3& position : surface.x) box.extend(to_eigen(position));
  const std::vector<Viewpoint> from = viewpoints_of(scan.sensors, box);
  constexpr std::uint8_t faces = 1;
  constexpr std::uint8_t clearly = 2;
  constexpr std::uint8_t sees_it = 1;
  constexpr std::uint8_t sees_through = 2;
  std::vector<std::vector<std::uint32_t>> numbers(std::max(from.size(), scan.sensors.size()));
  for (std::size_t i = 0; !scan.sensors.empty() && i < scan.size(); ++i) {
    numbers[scan.sensor_of(i)].push_back(static_cast<std::uint32_t>(i));
  }
  std::vector<std::vector<std::uint8_t>> views(from.size());
  const auto look = [&](std::size_t s) {
    auto& seen = views[s];
    seen.resize(k);
    const auto& [sensor, number] = from[s];
    std::vector<std::uint8_t> faces_it(k);
    for (std::size_t v = 0; v < k; ++v) {
      const auto towards = from_eigen(sensor) - surface.x[v];
      double along = dot(surface.normals[v], towards);
      if (settings.shows_insides && surface.is_sheet[v] != 0) along = std::abs(along);
      const double least = least_facing * std::sqrt(squared_norm(towards));
      faces_it[v] =
          static_cast<std::uint8_t>((along > 0 ? faces : 0) + (along > least ? clearly : 0));
    }
    if (box.contains(sensor)) {
      for (std::size_t v = 0; v < k; ++v) seen[v] = faces_it[v] != 0 ? sees_it : 0;
      return;
    }
    const View view(surface.x, sensor, box, surface.mean_edge, pixels_of_edge);
    if (!view.any()) return;
    // What faces away is not drawn: it hides nothing that its front does not hide.
    Depths own(view, 1);
    for (const Triangle& face : surface.faces) {
      const int any = faces_it[at(face[0])] | faces_it[at(face[1])] | faces_it[at(face[2])];
      if (any != 0) draw(view, face, own);
    }
    const Depths measured = measured_depths(view, scan, numbers[number]);
    for (std::size_t v = 0; v < k; ++v) {
      if (faces_it[v] < clearly) continue;
      if (is_measured[v] != 0) {
        seen[v] = sees_it;
        continue;
      }
      const View::Place& place = view.place_of(v);
      if (own.at(place).nearest < place[2] - slope_depth * surface.mean_edge) continue;
      const auto [nearest, n] = measured.around(place);
      if (n > 0 && nearest < place[2] - settings.near) continue;  // something else is before it
      seen[v] = sees_it;
      // Two cells aside, a surface that is seen flatly may lie so much farther.
      const double slope = 2 * measured.cell() * view.pixel_width() * place[2] / least_facing;
      const double behind = std::max(slope, quality_limits.near_noise * noise);
      if (n >= fewest_on_line && nearest > place[2] + behind) seen[v] |= sees_through;
    }
  };
  workers.for_each_in_chunks(from.size(), look, static_cast<Index>(k));
  for (std::size_t v = 0; v < k; ++v) {
    std::uint8_t any = 0;
    for (const auto& view : views) any |= view[v];
    if (any != 0) sight.seen[v] = sight.faced[v] = 1;
    sight.seen_through[v] = (any & sees_through) != 0 ? 1 : 0;
  }
  return sight;
}

}  // namespace dynmesh
