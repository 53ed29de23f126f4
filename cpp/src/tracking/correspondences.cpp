#include "tracking/correspondences.hpp"

#include <algorithm>
#include <cmath>
#include <memory>
#include <utility>

#include "support/geometry.hpp"
#include "tracking/vertex_normals.hpp"

namespace dynmesh {

Correspondences::Correspondences(std::span<const Triangle> faces, const Topology& topology,
                                 Workers& workers, const TrackingConstants& constants)
    : faces_(faces),
      is_sheet_(find_sheets(faces_, topology.component)),
      topology_(topology),
      workers_(workers),
      constants_(constants),
      is_cloth_(topology.cells.size()),
      sides_(topology.report.components),
      visibility_(topology.cells.size()),
      visible_(topology.cells.size()),
      normals_(topology.cells.size()),
      found_(topology.cells.size()),
      guesses_(topology.cells.size()),
      drawn_(topology.cells.size()),
      comparison_(faces_, topology.cells, workers, constants_) {}

std::unique_ptr<BoundaryReach> Correspondences::prepare(
    Field first_frame, std::span<const std::uint8_t> is_cloth) const {
  if (std::ranges::count(is_cloth, 1) == 0) return nullptr;
  return std::make_unique<BoundaryReach>(faces_, topology_, first_frame, is_cloth, workers_,
                                         constants_);
}

void Correspondences::reset(std::unique_ptr<BoundaryReach> boundary,
                            std::span<const std::uint8_t> is_cloth) noexcept {
  boundary_ = std::move(boundary);
  std::ranges::copy(is_cloth, is_cloth_.begin());
  std::ranges::fill(sides_, 0.0);
}

void Correspondences::begin(const Measurement& measurement, double mean_edge) {
  vertices_near_.assign(measurement.size(), Measurement::no_guess);
  std::ranges::fill(guesses_, Measurement::no_guess);
  measurement_ = &measurement;
  mean_edge_ = mean_edge;
}

/// The normals of X; those of cloth on the side that most sensors see.
void Correspondences::find_normals(Field x) {
  find_vertex_normals(faces_, x, normals_);
  if (boundary_ == nullptr) return;
  for (std::size_t v = 0; v < x.size(); ++v) {
    if (sides_[static_cast<std::size_t>(topology_.component[v])] < 0) {
      normals_[v] = -1.0 * normals_[v];
    }
  }
}

/// The faces of cloth may look to either side, which must not change what is found.
void Correspondences::choose_sides(Field x) {
  std::ranges::fill(sides_, 0.0);
  find_normals(x);
  for (const auto& viewpoint : measurement_->viewpoints()) {
    for (std::size_t v = 0; v < x.size(); ++v) {
      if (is_cloth_[v] == 0) continue;
      const auto view = viewpoint - x[v];
      const double distance = std::sqrt(squared_norm(view));
      if (!(distance > 0)) continue;
      sides_[static_cast<std::size_t>(topology_.component[v])] += dot(normals_[v], view) / distance;
    }
  }
}

void Correspondences::find_visible(Field x) {
  if (boundary_ != nullptr) choose_sides(x);
  find_normals(x);
  const Visibility::Tolerances tolerances = {constants_.pixel * mean_edge_,
                                             constants_.thickness * mean_edge_,
                                             constants_.back_thickness * mean_edge_};
  visibility_.find(faces_, x, normals_, measurement_->viewpoints(), is_sheet_, tolerances,
                   visible_);
}

/// The normals of X, on the side that the sensors see.
void Correspondences::find_visible_normals(Field x) {
  find_normals(x);
  for (std::size_t v = 0; v < x.size(); ++v) {
    if (visible_[v] == Sight::back) normals_[v] = -1.0 * normals_[v];
  }
}

bool Correspondences::have_share(double share) const {
  const auto hidden = std::ranges::count(visible_, Sight::hidden);
  const std::size_t most =
      std::min(visible_.size() - static_cast<std::size_t>(hidden), measurement_->size());
  return n_found_ > 0 && static_cast<double>(n_found_) >= share * static_cast<double>(most);
}

/// Each search begins with the vertex's own last point, not with that of a vertex before it: in
/// sparse images what is found depends on the beginning, and would on the order of the vertices and
/// on where chunks end.
std::span<Correspondence> Correspondences::find(Field x, const Search& of_bodies,
                                                const Search& of_cloth) {
  find_visible_normals(x);
  const Measurement& measurement = *measurement_;
  workers_.for_each_short_chunk(static_cast<Index>(x.size()), [&](Index first, Index last) {
    for (auto v = static_cast<std::size_t>(first); v < static_cast<std::size_t>(last); ++v) {
      const Search& search = is_cloth_[v] != 0 ? of_cloth : of_bodies;
      const double scale = search.scale * mean_edge_;
      const double side = search.side * mean_edge_;
      Correspondence& c = found_[v];
      c = {};
      if (visible_[v] == Sight::hidden || v % search.stride != 0) continue;
      const std::uint32_t guess = guesses_[v];
      const double radius = search.radius * mean_edge_;
      if (is_near(x, guess, v, search.kept)) {
        c = {measurement.point(guess), measurement.normal(guess), 1, guess};
      } else if (shows_both_sides(v)) {
        c = measurement.nearest_of_both_sides(x[v], normals_[v], radius, constants_.agreement,
                                              guess);
      } else {
        c = measurement.nearest(x[v], normals_[v], radius, constants_.agreement, guess);
      }
      if (c.weight == 0) continue;
      guesses_[v] = c.number;
      const auto offset = c.point - x[v];
      const double distance = squared_norm(offset);
      const double ahead = dot(offset, c.normal);
      const double aside = distance - ahead * ahead;
      c.weight = search.weight / ((1 + distance / (scale * scale)) * (1 + aside / (side * side)));
    }
  });
  weigh_shared_points();
  n_found_ = 0;
  for (std::size_t v = 0; v < x.size(); ++v) {
    if (!(found_[v].weight > 0)) continue;
    ++n_found_;
    vertices_near_[found_[v].number] = static_cast<std::uint32_t>(v);
  }
  return found_;
}

/// Where the measured surface ends, many vertices take the points of its edge. At most one of them
/// is there, and the positions of the others were not measured, so they count less.
void Correspondences::weigh_shared_points() {
  const std::size_t n_points = measurement_->size();
  vertices_per_point_.assign(n_points, 0);
  double n_found = 0;
  for (const Correspondence& c : found_) {
    if (!(c.weight > 0)) continue;
    ++vertices_per_point_[c.number];
    n_found += 1;
  }
  const double usual =
      std::max(1.0, constants_.vertices_per_point * n_found / static_cast<double>(n_points));
  for (Correspondence& c : found_) {
    if (!(c.weight > 0)) continue;
    const double excess = std::max(1.0, vertices_per_point_[c.number] / usual);
    c.weight /= excess * excess;
  }
}

/// Cloth has no thickness, so a point of either side is one of the vertex. For other surfaces, the
/// side that is not measured may be that of another part.
bool Correspondences::shows_both_sides(std::size_t v) const {
  return is_cloth_[v] != 0 && visible_[v] == Sight::both;
}

/// Whether a measured point is within some mean edges of a vertex, and their normals agree.
bool Correspondences::is_near(Field x, std::uint32_t point, std::size_t v, double radius) const {
  const Measurement& measurement = *measurement_;
  if (point == Measurement::no_guess || v >= x.size()) return false;
  const double reach = radius * mean_edge_;
  if (!(squared_norm(measurement.point(point) - x[v]) < reach * reach)) return false;
  const double cosine = dot(measurement.normal(point), normals_[v]);
  const bool is_either = measurement.is_undecided(point) || shows_both_sides(v);
  return (is_either ? std::abs(cosine) : cosine) >= constants_.agreement;
}

/// The share of the vertices that a sensor should see and that have no point within some mean
/// edges.
double Correspondences::share_without_point(Field x, double distance) const {
  const double reach = distance * mean_edge_;
  double n_seen = 0;
  double n_without = 0;
  for (std::size_t v = 0; v < x.size(); ++v) {
    if (visible_[v] == Sight::hidden) continue;
    n_seen += 1;
    const Correspondence& c = found_[v];
    const bool is_near = c.weight > 0 && squared_norm(c.point - x[v]) < reach * reach;
    n_without += is_near ? 0 : 1;
  }
  return n_seen > 0 ? n_without / n_seen : 0;
}

std::span<const Reach> Correspondences::find_reaches(Field x) {
  if (boundary_ == nullptr) return {};
  index_vertices(x);
  return boundary_->find({x, normals_, visible_, vertices_, mean_edge_}, *measurement_);
}

Agreements Correspondences::compare(Field x) const {
  return comparison_.compare({x, normals_, visible_, mean_edge_}, *measurement_, vertices_near_);
}

void Correspondences::index_vertices(Field x) {
  vertices_.points.assign(x.begin(), x.end());
  vertices_.normals.assign(normals_.begin(), normals_.end());
  if (boundary_ != nullptr) {
    vertices_.undecided.resize(x.size());
    for (std::size_t v = 0; v < x.size(); ++v) {
      vertices_.undecided[v] = shows_both_sides(v) ? 1 : 0;
    }
  }
  vertices_.index();
}

void Correspondences::draw_out_of_free_space(Field x, double weight) {
  if (boundary_ == nullptr) return;
  const Measurement& measurement = *measurement_;
  const double margin = constants_.thickness * mean_edge_;
  const double radius = constants_.narrow_radius * mean_edge_;
  constexpr double any_normal = -2;
  workers_.for_each_short_chunk(static_cast<Index>(x.size()), [&](Index first, Index last) {
    for (auto v = static_cast<std::size_t>(first); v < static_cast<std::size_t>(last); ++v) {
      const bool is_lost =
          is_cloth_[v] != 0 && visible_[v] != Sight::hidden && !(found_[v].weight > 0);
      if (!is_lost || !measurement.is_free(x[v], normals_[v], margin)) continue;
      const auto c = measurement.nearest_of_both_sides(x[v], normals_[v], radius, any_normal,
                                                       Measurement::no_guess);
      const auto offset = c.point - x[v];
      const double distance = squared_norm(offset);
      if (c.weight == 0 || !(distance > 0)) continue;
      found_[v] = {c.point, (1 / std::sqrt(distance)) * offset, weight, c.number};
    }
  });
}

double Correspondences::draw_towards_unexplained(Field x, double weight, double cloth_weight) {
  const Measurement& measurement = *measurement_;
  index_vertices(x);
  std::ranges::fill(drawn_, Correspondence{});
  const double radius = constants_.drawing_radius * mean_edge_;
  const double least = constants_.least_unexplained * mean_edge_;
  const double explained = constants_.explained * mean_edge_;
  // The points that are compared in the end, which then know a vertex that is near.
  const std::size_t stride = comparison_.stride_of(measurement);
  double n_near = 0;
  double n_unexplained = 0;
  for (std::size_t i = 0; i < measurement.size(); i += stride) {
    if (is_near(x, static_cast<std::uint32_t>(i), vertices_near_[i],
                constants_.least_unexplained)) {
      n_near += 1;
      continue;
    }
    const auto point = measurement.point(i);
    auto normal = measurement.normal(i);
    auto nearest = vertices_.find(point, normal, radius, constants_.agreement);
    if (measurement.is_undecided(i)) {
      const auto other = vertices_.find(point, -1.0 * normal, radius, constants_.agreement);
      if (other.squared_distance < nearest.squared_distance) {
        nearest = other;
        normal = -1.0 * normal;
      }
    }
    if (!nearest.any) continue;
    vertices_near_[i] = nearest.index;
    n_near += 1;
    if (nearest.squared_distance < least * least) continue;
    // A vertex that lies on the measured surface stays there: the point is of something else.
    const Correspondence& own = found_[nearest.index];
    if (visible_[nearest.index] == Sight::hidden) continue;
    if (own.weight > 0 && squared_norm(own.point - x[nearest.index]) < explained * explained) {
      continue;
    }
    n_unexplained += 1;
    Correspondence& drawn = drawn_[nearest.index];
    drawn.point = drawn.point + point;
    drawn.normal = drawn.normal + normal;
    drawn.weight += 1;
  }
  const double unexplained = n_near > 0 ? n_unexplained / n_near : 0;
  if (unexplained >
      constants_.largest_limb + share_without_point(x, constants_.least_unexplained)) {
    return 0;
  }
  const double scale = constants_.drawing_scale * mean_edge_;
  for (std::size_t v = 0; v < x.size(); ++v) {
    const Correspondence& drawn = drawn_[v];
    const double length = std::sqrt(squared_norm(drawn.normal));
    if (!(length > 0)) continue;
    const auto point = (1 / drawn.weight) * drawn.point;
    const double distance = squared_norm(point - x[v]);
    const double of_kind = is_cloth_[v] != 0 ? cloth_weight : weight;
    found_[v] = {point, (1 / length) * drawn.normal,
                 constants_.drawing_weight * of_kind / (1 + distance / (scale * scale)), 0};
  }
  return unexplained;
}

}  // namespace dynmesh
