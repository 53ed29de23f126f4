#include "quality/evidence.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>
#include <utility>

#include "base/geometry.hpp"
#include "base/point_tree.hpp"
#include "base/statistics.hpp"
#include "quality/limits.hpp"
#include "surface_fit/constants.hpp"

namespace dynmesh {
namespace {

/// The median of absolute values of a normal distribution, in standard deviations.
constexpr double median_deviation = 0.6745;
/// Fewer points tell no noise.
constexpr std::size_t fewest_numbers = 50;
/// About so many are enough, in stretches of so many that follow each other.
constexpr std::size_t noise_points = 6000;
constexpr std::size_t noise_row = 300;

/// To so many of the other points at most, the distance is measured.
constexpr std::size_t most_distances = 32;

/// How near a point must be to lie on the surface.
double reach_of(double noise, double mean_edge) {
  return std::max(quality_limits.near_edges * mean_edge, quality_limits.near_noise * noise);
}

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

/// How a point lies above the surface, and the vertex that is nearest to it there.
struct Height {
  std::uint32_t vertex;
  double height;
};

/// Heights, each compared with the mean of those at the same vertex.
std::vector<double> compared_at_vertices(std::span<const Height> heights, std::size_t n_vertices) {
  struct Sum {
    double heights = 0;
    double n = 0;
  };
  std::vector<Sum> sums(n_vertices);
  for (const auto& [v, height] : heights) {
    sums[v].heights += height;
    sums[v].n += 1;
  }
  std::vector<double> departures;
  for (const auto& [v, height] : heights) {
    const double n = sums[v].n;
    if (n > 1) departures.push_back((height - sums[v].heights / n) * std::sqrt(n / (n - 1)));
  }
  return departures;
}

}  // namespace

PointQuality quality_of(const BentSurface& surface, const MatchedPoints& points) {
  const std::size_t n_points = points.places.size();
  std::vector<Height> heights;
  double n = 0;
  double agreeing = 0;
  // Some stretches of the curve along which the points follow each other are enough.
  const std::size_t every = 1 + n_points / noise_points;
  for (std::size_t first = 0; first < n_points; first += every * noise_row) {
    for (std::size_t i = first; i < std::min(n_points, first + noise_row); ++i) {
      const Place& place = points.places[i];
      const auto& [position, normal, is_undecided] = points.points[i];
      if (place.any()) {
        const auto above = position - place.on(surface.x);
        heights.push_back({place.nearest_corner(), dot(above, unit_of(place.on(surface.normals)))});
      }
      if (i == first) continue;
      const Vector3& before = points.points[i - 1].normal;  // of a neighbour
      if (squared_norm(normal) == 0 || squared_norm(before) == 0) continue;
      n += 1;
      agreeing += std::abs(dot(normal, before)) > TrackingConstants{}.agreement ? 1 : 0;
    }
  }
  PointQuality found;
  found.noise = deviation_of(compared_at_vertices(heights, surface.x.size()));
  found.has_normals = agreeing > quality_limits.agreeing_neighbours * n;
  return found;
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

Evidence evidence_of(const BentSurface& surface, const MatchedPoints& points,
                     const SightSettings& settings, Workers& workers) {
  Evidence found;
  const PointQuality quality = found.points = quality_of(surface, points);
  const double reach = reach_of(quality.noise, surface.mean_edge);
  std::vector<std::uint8_t> is_explained(surface.x.size());
  std::vector<Vector3> others;
  double near = 0;
  std::vector<double> at_vertices(surface.x.size());  // how many of these
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
    at_vertices[place.nearest_corner()] += 1;
    for (std::size_t s = 0; s < 3; ++s) {
      if (place.shares[s] > 0) is_explained[place.corners[s]] = 1;
    }
  }
  const auto n = static_cast<double>(points.places.size());
  if (n > 0) found.others = static_cast<double>(others.size()) / n;
  found.others_distance = distance_to(surface, others);
  if (near > 0) found.wrong_side = wrong / near;

  const Sight sight =
      sight_of(surface, *points.scan, is_explained, quality.noise, settings, workers);
  const auto areas = areas_of(surface.faces, surface.x);
  double all = 0;
  double seen = 0;
  double flat = 0;  // of the points on it, those where sensors see it too flatly
  for (std::size_t v = 0; v < areas.size(); ++v) {
    all += areas[v];
    seen += sight.seen[v] != 0 ? areas[v] : 0;
    flat += sight.faced[v] == 0 ? at_vertices[v] : 0;
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
