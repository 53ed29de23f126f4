#include "quality/evidence.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>

#include "base/geometry.hpp"
#include "base/point_tree.hpp"
#include "base/rigid_motion.hpp"
#include "base/statistics.hpp"
#include "quality/limits.hpp"
#include "surface_fit/constants.hpp"
#include "surface_fit/view.hpp"

namespace dynmesh {
namespace {

/// The median of absolute values of a normal distribution, in standard deviations.
constexpr double median_deviation = 0.6745;
/// Fewer points tell no noise.
constexpr std::size_t fewest_numbers = 50;
/// About so many are enough, in stretches of so many that follow each other.
constexpr std::size_t noise_points = 6000;
constexpr std::size_t noise_row = 300;

/// A surface that is turned away farther is seen so flatly that sensors may miss it.
constexpr double least_facing = 0.35;
/// Neighbours on a slope do not hide each other.
constexpr double slope_depth = 1.5;  // mean edges
/// Fewer points around a line of sight tell nothing of it.
constexpr int fewest_on_line = 3;
/// To so many of the other points at most, the distance is measured.
constexpr std::size_t most_distances = 32;

/// How near a point must be to lie on the surface.
double reach_of(double noise, double mean_edge) {
  const double counted = noise < quality_limits.most_noise * mean_edge ? noise : 0;
  return std::max(quality_limits.near_edges * mean_edge, quality_limits.near_noise * counted);
}

/// What a sensor measured, in cells of the image of a surface and a cell around it.
class MeasuredDepths {
 public:
  MeasuredDepths(const View& view, const PointScan& scan, std::span<const std::uint32_t> numbers)
      : view_(view) {
    std::vector<View::Place> places;
    const auto across = static_cast<double>(view.width());
    const auto down = static_cast<double>(view.height());
    for (const std::uint32_t i : numbers) {
      const View::Place place = view.place_of(scan.points[i]);
      const bool is_within =
          place[2] > 0 && place[0] >= 0 && place[0] < across && place[1] >= 0 && place[1] < down;
      if (is_within) places.push_back(place);
    }
    // As large as an edge at least, and as the distances between points.
    const double spacing =
        std::sqrt(across * down / std::max(1.0, static_cast<double>(places.size())));
    cell_ = std::max(2.0, spacing);
    columns_ = static_cast<std::ptrdiff_t>(across / cell_) + 3;
    cells_.resize(
        static_cast<std::size_t>(columns_ * (static_cast<std::ptrdiff_t>(down / cell_) + 3)));
    for (const View::Place& place : places) {
      Cell& cell = cells_[number_of(place)];
      cell.nearest = std::min(cell.nearest, place[2]);
      ++cell.points;
    }
  }

  struct Cell {
    double nearest = std::numeric_limits<double>::infinity();
    int points = 0;
  };

  /// The points in the cells around a place of the image.
  [[nodiscard]] Cell around(const View::Place& place) const {
    Cell found;
    const auto middle = static_cast<std::ptrdiff_t>(number_of(place));
    for (std::ptrdiff_t row = -1; row <= 1; ++row) {
      for (std::ptrdiff_t column = -1; column <= 1; ++column) {
        const Cell& cell = cells_[static_cast<std::size_t>(middle + row * columns_ + column)];
        found.nearest = std::min(found.nearest, cell.nearest);
        found.points += cell.points;
      }
    }
    return found;
  }
  /// The width of a cell in pixels.
  [[nodiscard]] double cell() const { return cell_; }

 private:
  [[nodiscard]] std::size_t number_of(const View::Place& place) const {
    const auto row = static_cast<std::ptrdiff_t>(place[1] / cell_) + 1;
    const auto column = static_cast<std::ptrdiff_t>(place[0] / cell_) + 1;
    return static_cast<std::size_t>(row * columns_ + column);
  }

  const View& view_;
  double cell_ = 1;
  std::ptrdiff_t columns_ = 0;
  std::vector<Cell> cells_;
};

/// (k,) 1 for vertices that are at most so far along edges from one that is marked.
void spread_along_edges(const BentSurface& surface, double distance,
                        std::vector<std::uint8_t>& marks) {
  const auto rounds = static_cast<int>(distance / surface.mean_edge);
  for (int round = 0; round < rounds; ++round) {
    const std::vector<std::uint8_t> before = marks;
    for (std::size_t v = 0; v < marks.size(); ++v) {
      for (const Index other : surface.topology.cells[v]) marks[v] |= before[at(other)];
    }
  }
}

/// The median distance from the surface to some points, of which a few are enough.
double distance_to(const BentSurface& surface, const std::vector<Vector3>& points) {
  std::vector<double> distances;
  const std::size_t every = 1 + points.size() / most_distances;
  for (std::size_t i = 0; i < points.size(); i += every) {
    double nearest = std::numeric_limits<double>::infinity();
    for (const Vector3& x : surface.x) nearest = std::min(nearest, squared_norm(x - points[i]));
    distances.push_back(std::sqrt(nearest));
  }
  return distances.empty() ? 0 : quantile(std::move(distances), 0.5);
}

/// The standard deviation of normally distributed numbers with a mean of 0.
double deviation_of(std::vector<double> numbers) {
  if (numbers.size() < fewest_numbers) return 0;
  for (double& number : numbers) number = std::abs(number);
  return quantile(std::move(numbers), 0.5) / median_deviation;
}

/// How points lie above the surface, each compared with the mean of those at the same vertex.
std::vector<double> compared_at_vertices(std::span<const double> heights,
                                         const MatchedPoints& points, std::size_t n_vertices) {
  std::vector<double> sums(n_vertices);
  std::vector<double> numbers(n_vertices);
  const auto for_each_height = [&](const auto& visit) {
    for (std::size_t i = 0; i < heights.size(); ++i) {
      if (std::isfinite(heights[i])) visit(points.places[i].nearest_corner(), heights[i]);
    }
  };
  for_each_height([&](std::uint32_t v, double height) {
    sums[v] += height;
    numbers[v] += 1;
  });
  std::vector<double> departures;
  for_each_height([&](std::uint32_t v, double height) {
    const double n = numbers[v];
    if (n > 1) departures.push_back((height - sums[v] / n) * std::sqrt(n / (n - 1)));
  });
  return departures;
}

}  // namespace

PointQuality quality_of(const BentSurface& surface, const MatchedPoints& points) {
  constexpr double nothing = std::numeric_limits<double>::quiet_NaN();
  // Some stretches of the curve along which the points follow each other are enough.
  const std::size_t every = 1 + points.places.size() / noise_points;
  const auto is_left_out = [&](std::size_t i) { return i / noise_row % every != 0; };
  std::vector<double> heights(points.places.size(), nothing);
  for (std::size_t i = 0; i < heights.size(); ++i) {
    if (is_left_out(i)) continue;
    const Place& place = points.places[i];
    if (!place.any()) continue;
    const auto arm = points.points[i].position - place.on(surface.x);
    heights[i] = dot(arm, unit_of(place.on(surface.normals)));
  }
  // Points that follow each other are neighbours. Dense ones have a part of their
  // noise in common then, and are compared at vertices; sparse ones are alone there.
  const double squared_near = std::pow(2 * surface.mean_edge, 2);
  std::vector<double> steps;
  double n = 0;
  double agreeing = 0;
  for (std::size_t i = 1; i < heights.size(); ++i) {
    if (is_left_out(i) || is_left_out(i - 1)) continue;
    const auto& [position, normal, is_undecided] = points.points[i];
    const auto& before = points.points[i - 1];
    if (squared_norm(position - before.position) > squared_near) continue;
    const double step = (heights[i] - heights[i - 1]) / std::sqrt(2.0);
    if (std::isfinite(step)) steps.push_back(step);
    if (squared_norm(normal) == 0 || squared_norm(before.normal) == 0) continue;
    n += 1;
    agreeing += std::abs(dot(normal, before.normal)) > TrackingConstants{}.agreement ? 1 : 0;
  }
  PointQuality found;
  auto departures = compared_at_vertices(heights, points, surface.x.size());
  found.noise = deviation_of(std::move(departures.size() < fewest_numbers ? steps : departures));
  found.has_normals = agreeing > quality_limits.agreeing_neighbours * n;
  return found;
}

Sight sight_of(const BentSurface& surface, const PointScan& scan, double noise, double near,
               Workers& workers) {
  const std::size_t k = surface.x.size();
  Eigen::AlignedBox3d box;
  for (const Vector3& position : surface.x) box.extend(to_eigen(position));
  const std::vector<Viewpoint> from = drawn_from(scan.sensors, box);
  std::vector<std::vector<std::uint32_t>> numbers(scan.sensors.size());
  for (std::size_t i = 0; !scan.sensors.empty() && i < scan.size(); ++i) {
    numbers[scan.sensor_of(i)].push_back(static_cast<std::uint32_t>(i));
  }
  constexpr std::uint8_t sees_it = 1;
  constexpr std::uint8_t sees_through = 2;
  std::vector<std::vector<std::uint8_t>> views(from.size());
  const auto draw = [&](std::size_t s) {
    auto& seen = views[s];
    seen.resize(k);
    const auto& [sensor, number] = from[s];
    if (box.contains(sensor)) {
      for (std::size_t v = 0; v < k; ++v) {
        const auto towards = from_eigen(sensor) - surface.x[v];
        if (surface.is_sheet[v] != 0 || dot(surface.normals[v], towards) > 0) seen[v] = sees_it;
      }
      return;
    }
    // Cosines. What faces away is not drawn: it hides nothing that its front does not hide.
    std::vector<double> facing(k);
    for (std::size_t v = 0; v < k; ++v) {
      facing[v] = dot(surface.normals[v], unit_of(from_eigen(sensor) - surface.x[v]));
      if (surface.is_sheet[v] != 0) facing[v] = std::abs(facing[v]);
    }
    std::vector<Triangle> drawn;
    for (const Triangle& face : surface.faces) {
      if (std::ranges::any_of(face, [&](Index v) { return facing[at(v)] > 0; })) {
        drawn.push_back(face);
      }
    }
    const View view(drawn, {}, surface.x, sensor, box, surface.mean_edge);
    const std::span<const std::uint32_t> none_measured;
    const MeasuredDepths depths(view, scan, scan.sensors.empty() ? none_measured : numbers[number]);
    for (std::size_t v = 0; v < k; ++v) {
      if (!(facing[v] > least_facing)) continue;
      if (view.covers(v, slope_depth * surface.mean_edge)) continue;
      const View::Place& place = view.place_of(v);
      const auto [nearest, n] = depths.around(place);
      if (n > 0 && nearest < place[2] - near) continue;  // something else is before it
      seen[v] = sees_it;
      // Two cells aside, a surface that is seen flatly may lie so much farther.
      const double slope = 2 * depths.cell() * view.pixel_width() * place[2] / least_facing;
      const double behind = std::max(slope, quality_limits.near_noise * noise);
      if (n >= fewest_on_line && nearest > place[2] + behind) seen[v] |= sees_through;
    }
  };
  workers.for_each_in_chunks(from.size(), draw, static_cast<Index>(k));
  Sight sight{std::vector<std::uint8_t>(k), std::vector<std::uint8_t>(k)};
  for (std::size_t v = 0; v < k; ++v) {
    std::uint8_t any = 0;
    for (const auto& view : views) any |= view[v];
    sight.seen[v] = any != 0 ? 1 : 0;
    sight.seen_through[v] = (any & sees_through) != 0 ? 1 : 0;
  }
  return sight;
}

namespace {

/// Marks what is seen within a radius of a point of another component: a sensor that draws two
/// layers so near to each other sees both, but measures the outer one.
void explain_by_other_layers(const BentSurface& surface, const Sight& sight,
                             const MatchedPoints& points, double radius,
                             std::vector<std::uint8_t>& is_explained) {
  const std::vector<Index>& component = surface.topology.component;
  const bool has_layers = std::ranges::any_of(component, [](Index of) { return of != 0; });
  if (points.points.empty() || !has_layers) return;
  std::optional<PointTree<3>> tree;  // which many frames do not need
  for (std::size_t v = 0; v < surface.x.size(); ++v) {
    if (sight.seen[v] == 0 || is_explained[v] != 0) continue;
    if (!tree) {
      std::vector<Vector3> positions;
      for (const auto& point : points.points) positions.push_back(point.position);
      tree.emplace(arrays_of(positions));
    }
    const auto nearest = tree->nearest(array_of(surface.x[v]));
    if (!(nearest.squared < radius * radius)) continue;
    const auto place = points.places[nearest.number];
    is_explained[v] = place.any() && component[place.corners[0]] != component[v] ? 1 : 0;
  }
}

}  // namespace

Evidence evidence_of(const BentSurface& surface, const Sight& sight, const PointQuality& quality,
                     const MatchedPoints& points) {
  Evidence found;
  found.points = quality;
  const double reach = reach_of(quality.noise, surface.mean_edge);
  std::vector<std::uint8_t> is_explained(surface.x.size());
  std::vector<Vector3> others;
  double near = 0;
  double flat = 0;  // of these, those where sensors see the surface too flatly, or not at all
  double wrong = 0;
  for (std::size_t i = 0; i < points.places.size(); ++i) {
    const Place& place = points.places[i];
    if (!(place.squared < reach * reach)) {
      // A point that is too far to be the surface but not to be its noise is not of another thing.
      if (!(place.squared < 4 * reach * reach)) others.push_back(points.points[i].position);
      continue;
    }
    near += 1;
    const auto& [position, normal, is_undecided] = points.points[i];
    if (points.agrees[i] == 0 && quality.has_normals) {
      const bool has_side = !is_undecided && surface.is_sheet[place.corners[0]] == 0;
      wrong += has_side && dot(normal, place.on(surface.normals)) < 0 ? 1 : 0;
      continue;
    }
    flat += sight.seen[place.nearest_corner()] == 0 ? 1 : 0;
    for (std::size_t s = 0; s < 3; ++s) {
      if (place.shares[s] > 0) is_explained[place.corners[s]] = 1;
    }
  }
  const auto n = static_cast<double>(points.places.size());
  if (n > 0) found.others = static_cast<double>(others.size()) / n;
  found.others_distance = distance_to(surface, others);
  if (near > 0) found.wrong_side = wrong / near;

  auto areas = areas_of(surface.faces, surface.x);
  double all = 0;
  double seen = 0;
  for (std::size_t v = 0; v < areas.size(); ++v) {
    all += areas[v];
    seen += sight.seen[v] != 0 ? areas[v] : 0;
  }
  if (!(seen > 0) || 2 * flat > near) {
    // Most of it is too flat to the sensors to tell what is missing, but points tell where it is.
    const double own = n - static_cast<double>(others.size());
    if (own > 0) found.explained = near / own;
    return found;
  }
  const double spacing = std::sqrt(seen / std::max(near, 1.0));
  // A few points are not everywhere on a surface, however sparse they are.
  spread_along_edges(surface, std::min(quality_limits.hole_spacings * spacing, 0.15 * surface.size),
                     is_explained);
  const double between_layers = std::max(reach, slope_depth * surface.mean_edge);
  explain_by_other_layers(surface, sight, points, between_layers, is_explained);
  double explained = 0;
  double seen_through = 0;
  std::vector<std::uint8_t> is_missing(areas.size());
  for (std::size_t v = 0; v < areas.size(); ++v) {
    if (sight.seen[v] == 0) continue;
    if (is_explained[v] != 0) {
      explained += areas[v];
      continue;
    }
    is_missing[v] = 1;
    seen_through += sight.seen_through[v] != 0 ? areas[v] : 0;
  }
  found.seen = seen / all;
  found.explained = explained / seen;
  found.seen_through = seen_through / seen;
  found.hole = largest_piece(surface.topology.cells, areas, std::move(is_missing)) / all;
  return found;
}

}  // namespace dynmesh
