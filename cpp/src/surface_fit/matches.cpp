#include "surface_fit/matches.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <utility>

#include "base/geometry.hpp"
#include "base/statistics.hpp"

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

Matches::Matches(std::span<const Triangle> faces, const Topology& topology, Workers& workers,
                 const TrackingConstants& constants, Field first_frame, double mean_edge,
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
      places_(faces, first_frame),
      normals_(first_frame.size()) {
  for (const Index of : topology.component) {
    is_sheet_.push_back(materials_[at(of)].is_sheet ? 1 : 0);
  }
}

void Matches::begin(const PointScan& measurement) {
  measurement_ = &measurement;
  const auto order = measurement.along_curve();
  const std::size_t every = every_nth(order.size(), constants_.most_points);
  order_.clear();
  for (std::size_t i = 0; i < order.size(); i += every) order_.push_back(order[i]);
  found_.assign(order_.size(), {});
  points_.clear();
  for (const std::uint32_t i : order_) {
    points_.push_back({measurement.points[i], measurement.normals[i], measurement.is_undecided(i)});
  }
}

void Matches::find_normals(Field x) {
  normals_ = vertex_normals(faces_, x);
  for (std::size_t v = 0; v < x.size(); ++v) {
    normals_[v] = outside_[topology_.component[v]] * normals_[v];
  }
}

void Matches::look(Field x) {
  if (topology_.report.components < 2) return;
  find_normals(x);
  visibility_ = find_visibility(faces_, topology_.component, x, normals_, is_sheet_,
                                measurement_->sensors, mean_edge_, workers_);
  is_hidden_.resize(faces_.size());
  for (std::size_t f = 0; f < faces_.size(); ++f) {
    is_hidden_[f] =
        std::ranges::all_of(faces_[f], [&](Index v) { return visibility_.is_hidden[at(v)] != 0; });
  }
}

/// The normal of the surface at a place, on the side of that of the point; 0 if they disagree. A
/// point without a normal agrees everywhere.
Vector3 Matches::agreeing_normal(const Place& place, std::size_t point) const {
  auto normal = place.on(normals_);
  const double length = std::sqrt(squared_norm(normal));
  if (!(length > 0) || !place.any()) return {};
  const auto& measured = points_[point].normal;
  double cosine = dot(normal, measured) / length;
  const bool is_either = material_of(place).is_sheet || points_[point].is_undecided;
  if (is_either && cosine < 0) {
    normal = -1.0 * normal;
    cosine = -cosine;
  }
  const bool agrees = cosine > constants_.agreement || squared_norm(measured) == 0;
  return agrees ? (1 / length) * normal : Vector3{};
}

/// The nearest place within the radius, whatever its normal. The point walks over X from the place
/// of the last search, or of a neighbour, and only if this does not explain it, all of X is
/// searched.
Matches::Match Matches::nearest(Field x, std::size_t point, const Place& from,
                                const Search& search) const {
  const auto& position = points_[point].position;
  Place within = {.squared = std::pow(constants_.radius * mean_edge_, 2)};
  if (from.any()) {
    const Place place = places_.walk(x, position, from.face);
    if (is_outermost(place) && place.squared < std::pow(search.walked * mean_edge_, 2)) {
      const auto normal = agreeing_normal(place, point);
      if (squared_norm(normal) > 0) return {place, normal};
    }
    if (is_outermost(place) && place.squared < within.squared) within = place;
  }
  const Place place =
      places_.nearest(x, position, within, [&](const Place& near) { return is_outermost(near); });
  if (!(place.squared < std::pow(constants_.radius * mean_edge_, 2))) return {};
  return {place, agreeing_normal(place, point)};
}

void Matches::measure_heights(Field frame, Matches& finer, Field finer_frame) {
  find_normals(frame);
  finer.places_.follow(finer_frame);
  const auto anywhere = [](const Place&) { return true; };
  heights_.resize(faces_.size());
  workers_.for_each_in_chunks(faces_.size(), [&](std::size_t f) {
    for (std::size_t s = 0; s < 3; ++s) {
      const auto a = at(faces_[f][(s + 1) % 3]);
      const auto b = at(faces_[f][(s + 2) % 3]);
      const auto middle = 0.5 * (frame[a] + frame[b]);
      const auto sum = normals_[a] + normals_[b];
      const double length = std::sqrt(squared_norm(sum));
      if (!(length > 0)) continue;
      const auto normal = (1 / length) * sum;
      double height = 0;
      for (int step = 0; step < 3; ++step) {
        const auto point = middle + height * normal;
        const Place place = finer.places_.nearest(
            finer_frame, point, {.squared = mean_edge_ * mean_edge_ / 4}, anywhere);
        if (place.any()) height += dot(place.on(finer_frame) - point, normal);
      }
      heights_[f][s] = std::clamp(height, -mean_edge_ / 2, mean_edge_ / 2);
    }
  });
}

/// How high the finer surface is above a place: quadratic between the corners and the middles of
/// the sides.
double Matches::height(const Place& place) const {
  double sum = 0;
  for (std::size_t s = 0; s < 3; ++s) {
    sum += 4 * heights_[place.face][s] * place.shares[(s + 1) % 3] * place.shares[(s + 2) % 3];
  }
  return sum;
}

template <class Visit>
void Matches::for_each_block(const Visit& visit) const {
  const std::size_t n = points_.size();
  const auto visit_block = [&](std::size_t block) {
    visit(block * in_a_row, std::min((block + 1) * in_a_row, n));
  };
  workers_.for_each_in_chunks((n + in_a_row - 1) / in_a_row, visit_block,
                              static_cast<Index>(in_a_row));
}

void Matches::locate(Field x, double walked) {
  find_normals(x);
  places_.follow(x);
  for_each_block([&](std::size_t first, std::size_t last) {
    Place before;
    for (std::size_t i = first; i < last; ++i) {
      found_[i] = nearest(x, i, found_[i].any() ? found_[i] : before, {.walked = walked}).place;
      if (found_[i].any()) before = found_[i];
    }
  });
}

const Matches::Rows& Matches::find(Field x, const Search& search) {
  find_normals(x);
  places_.follow(x);
  const double squared_near = std::pow(constants_.near * mean_edge_, 2);
  const std::size_t every = std::min(every_nth(points_.size(), search.points), in_a_row);
  rows_.resize(points_.size());
  for_each_block([&](std::size_t first, std::size_t last) {
    for (std::size_t i = first; i < last; ++i) rows_[i].weight = 0;
    Place before;
    for (std::size_t i = first; i < last; i += every) {
      Match match = nearest(x, i, found_[i].any() ? found_[i] : before, search);
      found_[i] = match.place;
      if (!found_[i].any()) continue;
      before = found_[i];
      if (search.looks_farther && squared_norm(match.normal) == 0 &&
          found_[i].squared > squared_near) {
        // Something else is nearer, as the other side of a thin limb is. Where a surface moves to a
        // point, the point lies along its normal; a foot lies beside what agrees with a floor.
        match.place = places_.nearest(
            x, points_[i].position, {.squared = std::pow(constants_.radius * mean_edge_, 2)},
            [&](const Place& place) {
              return is_outermost(place) && squared_norm(agreeing_normal(place, i)) > 0;
            });
        match.normal = agreeing_normal(match.place, i);
        const double along = std::abs(dot(match.place.on(x) - points_[i].position, match.normal));
        if (along < constants_.along * std::sqrt(match.place.squared)) match.normal = {};
      }
      if (squared_norm(match.normal) == 0) continue;
      const double sign = dot(points_[i].normal, match.normal) < 0 ? -1 : 1;
      const auto mean = sign * points_[i].normal + match.normal;
      rows_[i] = {match.place, (1 / std::sqrt(squared_norm(mean))) * mean, points_[i].position, 1};
      if (!heights_.empty()) {
        const bool is_outside = dot(match.place.on(normals_), match.normal) > 0;
        const double height = is_outside ? this->height(match.place) : -this->height(match.place);
        rows_[i].point = rows_[i].point - height * match.normal;
      }
    }
  });
  std::erase_if(rows_, [](const SurfaceRow& row) { return row.weight == 0; });
  weigh(x, search, static_cast<double>(every));
  return rows_;
}

/// Points that are denser than the vertices count together as much as these. Each row stands for
/// `points_of_row` points.
void Matches::weigh(Field x, const Search& search, double points_of_row) {
  const auto usual = search.scale == 0 ? usual_distances() : std::vector<double>{};
  std::vector<std::uint8_t> touched(normals_.size());
  std::vector<double> sums(topology_.report.components);
  const auto component = [&](const SurfaceRow& row) { return topology_.component[row.corners[0]]; };
  for (SurfaceRow& row : rows_) {
    const double distance = std::sqrt(row.squared) / mean_edge_;
    const double ratio =
        distance /
        (usual.empty() ? search.scale : usual[clusters_.of_vertex[row.nearest_corner()]]);
    const double far = 1 + ratio * ratio;
    row.weight = points_of_row / (usual.empty() ? far : far * far);
    sums[at(component(row))] += row.weight;
    for (const auto corner : row.corners) touched[corner] = 1;
  }
  if (!usual.empty()) boundary_.draw(x, normals_, rows_);
  const auto is_measured = find_measured();
  std::erase_if(rows_, [&](const SurfaceRow& row) {
    return sums[at(component(row))] < constants_.least_weight ||
           is_measured[at(component(row))] == 0;
  });
  const double density =
      std::min(1.0, static_cast<double>(std::ranges::count(touched, 1)) /
                        (points_of_row * std::max(static_cast<double>(rows_.size()), 1.0)));
  for (SurfaceRow& row : rows_) {
    row.weight *= density * (usual.empty() ? 1 : material_of(row).point_weight * search.weight);
  }
}

OrientedPoints Matches::unexplained() const {
  OrientedPoints far;
  for (std::size_t i = 0; i < found_.size(); ++i) {
    if (!is_far(found_[i])) continue;
    far.points.push_back(points_[i].position);
    far.normals.push_back(points_[i].is_undecided ? Vector3{} : points_[i].normal);
  }
  return far;
}

std::vector<std::uint8_t> Matches::find_measured() const {
  std::vector<std::uint8_t> is_measured(topology_.report.components, 1);
  if (is_measured.size() < 2) return is_measured;
  std::vector<double> points(is_measured.size());
  double all = 0;
  for (const Place& place : found_) {
    if (!place.any()) continue;
    points[at(topology_.component[place.corners[0]])] += 1;
    all += 1;
  }
  for (std::size_t c = 0; c < points.size(); ++c) {
    const double due = all * visibility_.shares[c];
    is_measured[c] = points[c] < constants_.least_measured * due ? 0 : 1;
  }
  return is_measured;
}

/// (k,) the distance of each vertex from the nearest of its points; infinite without any.
std::vector<double> Matches::nearest_distances() const {
  std::vector<double> distances(normals_.size(), std::numeric_limits<double>::infinity());
  for (const SurfaceRow& row : rows_) {
    double& nearest = distances[row.nearest_corner()];
    nearest = std::min(nearest, std::sqrt(row.squared) / mean_edge_);
  }
  return distances;
}

/// (clusters,) the distance at which points count a quarter: where the surface has not arrived yet,
/// all are far, and where it has, those that are far are of something else.
std::vector<double> Matches::usual_distances() const {
  const auto nearest = nearest_distances();
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
    if (around.empty()) return;
    usual[c] = std::clamp(constants_.usual_distances * median(around), constants_.resolution,
                          constants_.largest_scale);
  };
  workers_.for_each_in_chunks(usual.size(), find, vertices_around);
  return usual;
}

double Matches::distance_of(double share) const {
  auto distances = nearest_distances();
  std::erase_if(distances, [](double distance) { return !std::isfinite(distance); });
  return distances.empty() ? 0 : quantile(std::move(distances), share);
}

void Matches::follow(Field x) {
  find_normals(x);
  agrees_.resize(found_.size());
  workers_.for_each_in_chunks(found_.size(), [&](std::size_t i) {
    if (found_[i].any()) found_[i].squared = squared_norm(points_[i].position - found_[i].on(x));
    agrees_[i] = is_outermost(found_[i]) && squared_norm(agreeing_normal(found_[i], i)) > 0 ? 1 : 0;
  });
}

}  // namespace dynmesh
