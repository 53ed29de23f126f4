#include "surface_fit/surface_matcher.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <utility>

#include "base/geometry.hpp"
#include "base/statistics.hpp"
#include "surface_fit/surface_colours.hpp"

namespace dynmesh {
namespace {

/// So many points along the curve are matched one after the other, each from the place of the one
/// before it: always the same ones, so that results are the same for any number of threads.
constexpr std::size_t in_a_row = 256;

/// So that about as many as wanted are left of them; 1 if there are no more.
std::size_t every_nth(std::size_t points, std::size_t wanted) {
  const double spacing = static_cast<double>(points) / static_cast<double>(wanted);
  return std::max<std::size_t>(static_cast<std::size_t>(std::llround(spacing)), 1);
}

}  // namespace

SurfaceMatcher::SurfaceMatcher(std::span<const Triangle> faces, const Topology& topology,
                               Workers& workers, const TrackingConstants& constants,
                               Field first_frame, double mean_edge,
                               std::span<const Material> materials, const Clusters& clusters)
    : faces_(faces),
      topology_(topology),
      workers_(workers),
      constants_(constants),
      mean_edge_(mean_edge),
      materials_(materials),
      clusters_(clusters),
      outside_(find_outsides(faces, topology, first_frame, mean_edge)),
      boundary_(faces, topology, mean_edge, materials, constants),
      places_(faces, first_frame) {
  for (const Index of : topology.component) {
    is_sheet_.push_back(materials_[at(of)].is_sheet ? 1 : 0);
  }
}

MatchedPoints SurfaceMatcher::points_of(const PointScan& scan) const {
  MatchedPoints some{&scan, mean_edge_, {}, {}, {}, {}};
  const auto order = scan.along_curve();
  const std::size_t every = every_nth(order.size(), constants_.most_points);
  for (std::size_t i = 0; i < order.size(); i += every) some.numbers.push_back(order[i]);
  for (const std::uint32_t i : some.numbers) {
    some.points.push_back({scan.points[i], scan.normals[i], scan.is_undecided(i)});
  }
  some.places.resize(some.points.size());
  return some;
}

std::vector<Vector3> SurfaceMatcher::normals_of(Field x) const {
  auto normals = vertex_normals(faces_, x);
  for (std::size_t v = 0; v < x.size(); ++v) {
    normals[v] = outside_[topology_.component[v]] * normals[v];
  }
  return normals;
}

Visibility SurfaceMatcher::visibility_of(Field x, const PointScan& scan) const {
  if (topology_.report.components < 2) return {};
  return find_visibility(faces_, topology_.component, x, normals_of(x), is_sheet_, scan.sensors,
                         mean_edge_, workers_);
}

/// The normal of the surface at a place, on the side of that of the point; 0 if they disagree. A
/// point without a normal agrees everywhere.
Vector3 SurfaceMatcher::agreeing_normal(const Surface& surface, const Place& place,
                                        const Point& point) const {
  auto normal = place.on(surface.normals);
  const double length = std::sqrt(squared_norm(normal));
  if (!(length > 0) || !place.any()) return {};
  double cosine = dot(normal, point.normal) / length;
  const bool is_either = material_of(place).is_sheet || point.is_undecided;
  if (is_either && cosine < 0) {
    normal = -1.0 * normal;
    cosine = -cosine;
  }
  const bool agrees = cosine > constants_.agreement || squared_norm(point.normal) == 0;
  return agrees ? (1 / length) * normal : Vector3{};
}

/// The nearest place within the radius, whatever its normal. The point walks over X from the place
/// of the last search, or of a neighbour, and only if this does not explain it, all of X is
/// searched, or all of the component that explains it roughly: of components that touch, as of a
/// shell and what it covers, others may be nearer by chance.
SurfaceMatcher::Match SurfaceMatcher::nearest(const Surface& surface, const Point& point,
                                              const Place& from, const Walk& walk) const {
  const auto is_within = [&](const Place& place, double edges) {
    return place.squared < std::pow(edges * mean_edge_, 2);
  };
  const auto component_of = [&](const Place& place) {
    return topology_.component[place.corners[0]];
  };
  Place within = {.squared = std::pow(widest(), 2)};
  Index component = none;
  if (from.any()) {
    const Place place = places_.walk(surface.x, point.position, from.face);
    if (surface.shows(place) && is_within(place, walk.most)) {
      const auto normal = agreeing_normal(surface, place, point);
      if (squared_norm(normal) > 0) {
        if (is_within(place, walk.sure)) return {place, normal};
        component = component_of(place);
      }
    }
    if (surface.shows(place) && place.squared < within.squared) within = place;
  }
  const Place place = places_.nearest(surface.x, point.position, within, [&](const Place& near) {
    return surface.shows(near) && (component == none || component_of(near) == component);
  });
  if (!(place.squared < std::pow(widest(), 2))) return {};
  return {place, agreeing_normal(surface, place, point)};
}

/// How near a place must be that a point walked to, at most: as usual among some points, of which
/// `place_of(i)` is the nearest.
double SurfaceMatcher::usual_walk(std::size_t n, double most,
                                  const std::function<Place(std::size_t)>& place_of) const {
  std::vector<double> distances;
  for (std::size_t i = 0; i < n; i += constants_.points_of_search) {
    const Place place = place_of(i);
    if (place.any()) distances.push_back(std::sqrt(place.squared) / mean_edge_);
  }
  if (distances.empty()) return most;
  const double usual = constants_.usual_walk * median(distances);
  return std::min(std::max(usual, constants_.least_walk), most);
}

/// The nearest place that agrees with a point of which the nearest one does not: something else is
/// nearer, as the other side of a thin limb is. Where a surface moves to a point, the point lies
/// along its normal; a foot lies beside what agrees with a floor.
SurfaceMatcher::Match SurfaceMatcher::farther(const Surface& surface, const Point& point) const {
  Match match;
  match.place = places_.nearest(
      surface.x, point.position, {.squared = std::pow(widest(), 2)}, [&](const Place& place) {
        return surface.shows(place) && squared_norm(agreeing_normal(surface, place, point)) > 0;
      });
  match.normal = agreeing_normal(surface, match.place, point);
  const double along = std::abs(dot(match.place.on(surface.x) - point.position, match.normal));
  if (along < constants_.along * std::sqrt(match.place.squared)) match.normal = {};
  return match;
}

void SurfaceMatcher::measure_heights(Field frame, SurfaceMatcher& finer, Field finer_frame) {
  finer.places_.update_boxes(finer_frame);
  heights_ = FinerHeights(faces_, frame, normals_of(frame), mean_edge_, finer.places_, finer_frame,
                          workers_);
}

/// From a place to the finer surface, along the normal on the side of the point.
Vector3 SurfaceMatcher::to_finer(const Surface& surface, const Match& match) const {
  const bool is_outside = dot(match.place.on(surface.normals), match.normal) > 0;
  return (is_outside ? heights_.at(match.place) : -heights_.at(match.place)) * match.normal;
}

// A point that is farther than the resolution is of something else, or of what has moved.
void SurfaceMatcher::compare_with(Field x, const Visibility& visibility,
                                  const SurfaceMatcher& finer, Field finer_frame,
                                  MatchedPoints& points) {
  const auto normals = normals_of(x);
  const Surface surface{x, normals, visibility};
  const double squared_near = std::pow(constants_.resolution * mean_edge_, 2);
  places_.update_boxes(x);
  points.corrections.resize(points.points.size());
  struct Compared {
    Match match;
    Place there = {};
  };
  const double most = constants_.resolution;
  const auto compare = [&](const Point& point, const Place& from, double sure) {
    Compared compared{nearest(surface, point, from, {most, sure})};
    const auto& [place, normal] = compared.match;
    if (squared_norm(normal) > 0 && place.squared < squared_near) {
      compared.there = finer.places_.walk(finer_frame, point.position, heights_.face_near(place));
    }
    return compared;
  };
  const double usual = usual_walk(points.points.size(), most, [&](std::size_t i) {
    return compare(points.points[i], {}, 0).there;
  });
  const double squared_usual = std::pow(usual * mean_edge_, 2);
  for_each_block(points.points.size(), [&](std::size_t first, std::size_t last) {
    Place before;
    for (std::size_t i = first; i < last; ++i) {
      const Point& point = points.points[i];
      Compared compared = compare(point, before, most);
      const bool is_layer = compared.there.any() && compared.there.squared > squared_usual;
      if (is_layer) compared = compare(point, before, 0);
      const auto& [match, there] = compared;
      if (!match.place.any()) continue;
      before = points.places[i] = match.place;
      if (!(there.squared < squared_near)) continue;
      const auto offset = there.on(finer_frame) - match.place.on(x) - to_finer(surface, match);
      points.corrections[i] = {match.place, offset};
    }
  });
}

template <class Visit>
void SurfaceMatcher::for_each_block(std::size_t n, const Visit& visit) const {
  const auto visit_block = [&](std::size_t block) {
    visit(block * in_a_row, std::min((block + 1) * in_a_row, n));
  };
  workers_.for_each_in_chunks((n + in_a_row - 1) / in_a_row, visit_block,
                              static_cast<Index>(in_a_row));
}

void SurfaceMatcher::nearest_places(Field x, const Visibility& visibility, double walked,
                                    MatchedPoints& points) {
  const auto normals = normals_of(x);
  const Surface surface{x, normals, visibility};
  places_.update_boxes(x);
  for_each_block(points.places.size(), [&](std::size_t first, std::size_t last) {
    Place before;
    for (std::size_t i = first; i < last; ++i) {
      Place& place = points.places[i];
      const Place& from = place.any() ? place : before;
      place = nearest(surface, points.points[i], from, {walked, walked}).place;
      if (place.any()) before = place;
    }
  });
}

SurfaceMatcher::Rows SurfaceMatcher::match(Field x, const Visibility& visibility,
                                           const MatchOptions& options, MatchedPoints& points) {
  const auto normals = normals_of(x);
  const Surface surface{x, normals, visibility};
  places_.update_boxes(x);
  const double squared_near = std::pow(constants_.near * mean_edge_, 2);
  const double squared_reach = std::pow(constants_.corrected_within * mean_edge_, 2);
  const std::size_t n = points.points.size();
  const std::size_t every = std::min(every_nth(n, options.points), in_a_row);
  Walk walk = {options.walked, options.walked};
  if (options.tells_layers) {
    walk.sure = usual_walk(n, walk.most, [&](std::size_t i) {
      return nearest(surface, points.points[i], points.places[i], {}).place;
    });
  }
  Rows rows(n);
  for_each_block(n, [&](std::size_t first, std::size_t last) {
    Place before;
    for (std::size_t i = first; i < last; i += every) {
      const Point& point = points.points[i];
      Place& place = points.places[i];
      Match match = nearest(surface, point, place.any() ? place : before, walk);
      place = match.place;
      if (!place.any()) continue;
      before = place;
      if (options.looks_farther && squared_norm(match.normal) == 0 &&
          place.squared > squared_near) {
        match = farther(surface, point);
      }
      if (squared_norm(match.normal) == 0) continue;
      const double sign = dot(point.normal, match.normal) < 0 ? -1 : 1;
      const auto mean = sign * point.normal + match.normal;
      rows[i] = {match.place, (1 / std::sqrt(squared_norm(mean))) * mean, point.position, 1, i};
      if (!heights_.empty()) rows[i].point = rows[i].point - to_finer(surface, match);
      if (!points.corrections.empty()) {
        const auto& [at_place, offset] = points.corrections[i];
        const double moved = squared_norm(match.place.on(x) - at_place.on(x)) / squared_reach;
        rows[i].point = rows[i].point - (1 / ((1 + moved) * (1 + moved))) * offset;
      }
    }
  });
  std::erase_if(rows, [](const SurfaceRow& row) { return row.weight == 0; });
  weigh(surface, options, static_cast<double>(every), points, rows);
  if (options.colours != nullptr) {
    add_colour_rows(faces_, x, *options.colours, points, constants_, clusters_, workers_, rows);
  }
  return rows;
}

/// Points that are denser than the vertices count together as much as these. Each row stands for
/// `points_of_row` points.
void SurfaceMatcher::weigh(const Surface& surface, const MatchOptions& options,
                           double points_of_row, const MatchedPoints& points, Rows& rows) const {
  const auto usual = options.scale == 0 ? usual_distances(rows) : std::vector<double>{};
  std::vector<std::uint8_t> touched(surface.x.size());
  std::vector<double> sums(topology_.report.components);
  const auto component = [&](const SurfaceRow& row) { return topology_.component[row.corners[0]]; };
  for (SurfaceRow& row : rows) {
    const double distance = std::sqrt(row.squared) / mean_edge_;
    const double ratio =
        distance /
        (usual.empty() ? options.scale : usual[clusters_.of_vertex[row.nearest_corner()]]);
    const double far = 1 + ratio * ratio;
    row.weight = points_of_row / (usual.empty() ? far : far * far);
    sums[at(component(row))] += row.weight;
    for (const auto corner : row.corners) touched[corner] = 1;
  }
  if (!usual.empty()) boundary_.draw(surface.x, surface.normals, rows);
  const auto is_measured = find_measured(surface.visibility, points);
  std::erase_if(rows, [&](const SurfaceRow& row) {
    return sums[at(component(row))] < constants_.least_weight ||
           is_measured[at(component(row))] == 0;
  });
  const double density =
      std::min(1.0, static_cast<double>(std::ranges::count(touched, 1)) /
                        (points_of_row * std::max(static_cast<double>(rows.size()), 1.0)));
  for (SurfaceRow& row : rows) {
    row.weight *= density * (usual.empty() ? 1 : material_of(row).point_weight * options.weight);
  }
}

std::vector<std::uint8_t> SurfaceMatcher::find_measured(const Visibility& visibility,
                                                        const MatchedPoints& points) const {
  std::vector<std::uint8_t> is_measured(topology_.report.components, 1);
  if (is_measured.size() < 2) return is_measured;
  std::vector<double> numbers(is_measured.size());
  double all = 0;
  for (const Place& place : points.places) {
    if (!place.any()) continue;
    numbers[at(topology_.component[place.corners[0]])] += 1;
    all += 1;
  }
  for (std::size_t c = 0; c < numbers.size(); ++c) {
    const double due = all * visibility.shares[c];
    is_measured[c] = numbers[c] < constants_.least_measured * due ? 0 : 1;
  }
  return is_measured;
}

/// (k,) the distance of each vertex from the nearest of its points; infinite without any.
std::vector<double> SurfaceMatcher::nearest_distances(std::span<const SurfaceRow> rows) const {
  std::vector<double> distances(topology_.component.size(),
                                std::numeric_limits<double>::infinity());
  for (const SurfaceRow& row : rows) {
    double& nearest = distances[row.nearest_corner()];
    nearest = std::min(nearest, std::sqrt(row.squared) / mean_edge_);
  }
  return distances;
}

/// (clusters,) the distance at which points count a quarter: where the surface has not arrived yet,
/// all are far, and where it has, those that are far are of something else.
std::vector<double> SurfaceMatcher::usual_distances(std::span<const SurfaceRow> rows) const {
  const auto nearest = nearest_distances(rows);
  std::vector<double> usual(clusters_.size(), constants_.resolution);
  constexpr Index vertices_around = 60;
  const auto find = [&](std::size_t c) {
    std::vector<double> around;
    const auto add = [&](std::size_t cluster) {
      for (const Index v : clusters_.members[cluster]) {
        if (std::isfinite(nearest[at(v)])) around.push_back(nearest[at(v)]);
      }
    };
    add(c);
    for (const Index other : clusters_.neighbours[c]) add(at(other));
    // Where most are so small, the median is not needed.
    const auto is_small = [&](double distance) {
      return constants_.usual_distances * distance <= constants_.resolution;
    };
    const bool are_small = 2 * std::ranges::count_if(around, is_small) > std::ssize(around);
    if (around.empty() || are_small) return;
    usual[c] = std::clamp(constants_.usual_distances * median(around), constants_.resolution,
                          constants_.largest_scale);
  };
  workers_.for_each_in_chunks(usual.size(), find, vertices_around);
  return usual;
}

double SurfaceMatcher::distance_of(double share, std::span<const SurfaceRow> rows) const {
  auto distances = nearest_distances(rows);
  std::erase_if(distances, [](double distance) { return !std::isfinite(distance); });
  return distances.empty() ? 0 : quantile(std::move(distances), share);
}

void SurfaceMatcher::update_distances(Field x, Field normals, const Visibility& visibility,
                                      MatchedPoints& points) const {
  const Surface surface{x, normals, visibility};
  points.agrees.resize(points.places.size());
  workers_.for_each_in_chunks(points.places.size(), [&](std::size_t i) {
    const Point& point = points.points[i];
    Place& place = points.places[i];
    if (place.any()) place.squared = squared_norm(point.position - place.on(x));
    const bool agrees = squared_norm(agreeing_normal(surface, place, point)) > 0;
    points.agrees[i] = surface.shows(place) && agrees ? 1 : 0;
  });
}

}  // namespace dynmesh
