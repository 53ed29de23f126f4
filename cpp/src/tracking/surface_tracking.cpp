#include "tracking/surface_tracking.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <limits>
#include <stdexcept>
#include <utility>

#include "support/geometry.hpp"
#include "tracking/rigid_alignment.hpp"
#include "tracking/vertex_normals.hpp"

namespace dynmesh {
namespace {

DetailConstants constants_for(const TrackingConstants& tracking) {
  DetailConstants constants;
  constants.rehearsal.largest_kept = tracking.largest_kept;
  return constants;
}

}  // namespace

SurfaceTracking::SurfaceTracking(std::vector<Triangle> faces, const Topology& topology,
                                 Workers& workers, const TrackingConstants& constants,
                                 Take<double> take, bool has_uncertainty)
    : constants_(constants),
      detail_constants_(constants_for(constants)),
      faces_(std::move(faces)),
      topology_(topology),
      workers_(workers),
      system_(topology.cells, workers),
      rotations_(topology.cells, workers),
      fit_(topology.cells.size()),
      visibility_(topology.cells.size()),
      rest_(topology.cells, workers, detail_constants_, std::move(take)),
      error_bars_(topology.cells, workers, detail_constants_, has_uncertainty, true),
      shape_(topology.cells.size()),
      last_(topology.cells.size()),
      before_(topology.cells.size()),
      anchors_(topology.cells.size(), true),
      x_(topology.cells.size()),
      normals_(topology.cells.size()),
      wanted_(topology.cells.size()),
      turned_(topology.cells.size()),
      found_(topology.cells.size()),
      seen_(topology.cells.size()),
      observed_(topology.cells.size()),
      found_in_(topology.report.components),
      old_rotations_(topology.cells.size()),
      guesses_(topology.cells.size()),
      drawn_(topology.cells.size()),
      factored_weights_(rest_.is_rehearsed() ? topology.cells.size() : 0),
      kx_(has_uncertainty ? topology.cells.size() : 0),
      planes_(kx_.size()) {
  if (has_uncertainty) system_.take_planes(constants.steps);
}

void SurfaceTracking::reset(Field first_frame) {
  auto prepared = system_.prepare<double>(faces_, first_frame, detail_constants_);
  auto prepared_rotations = rotations_.prepare(first_frame);
  const double mean_edge = mean_edge_length(topology_.cells, first_frame);
  rest_.reset(rest_.learn(prepared.k, first_frame, mean_edge));
  // Nothing below can throw.
  system_.reset(std::move(prepared));
  mean_edge_ = mean_edge;
  rotations_.reset(std::move(prepared_rotations), first_frame, mean_edge_);
  system_.apply(first_frame, 1, shape_);
  rest_.set_first(shape_);
  error_bars_.reset();
  std::ranges::copy(first_frame, last_.begin());
  std::ranges::copy(first_frame, before_.begin());
  is_first_ = true;
}

SurfaceTracking::Found SurfaceTracking::find(const Measurement& measurement) {
  std::ranges::copy(rotations_.quaternions(), old_rotations_.begin());
  rest_.begin_frame();
  try {
    std::ranges::fill(guesses_, Measurement::no_guess);
    vertices_near_.assign(measurement.size(), Measurement::no_guess);
    is_factored_ = false;
    predict();
    const bool aligned = is_first_ && measurement.size() > 0 && align(measurement);
    look(measurement);
    const double scale = constants_.rigid_scale;
    for (int step = 0; step < constants_.rigid_steps; ++step) {
      move_as_a_whole(measurement, {constants_.rigid_radius, scale, scale, 1, rigid_stride()});
    }
    const int searches = search(measurement);
    for (int pass = 1; pass < constants_.passes; ++pass) {
      const double progress = static_cast<double>(pass) / (constants_.passes - 1);
      bend(measurement, weight_at(progress), 2 * pass < constants_.passes,
           pass == constants_.posing_pass);
    }
    Found result = observe(measurement);
    result.passes = searches + constants_.passes - 1;
    result.aligned = aligned;
    return result;
  } catch (...) {
    std::ranges::copy(old_rotations_, rotations_.quaternions().begin());
    rest_.undo_frame();
    throw;
  }
}

/// X = V + prediction (V - V'), from the last two frames.
void SurfaceTracking::predict() {
  for (std::size_t v = 0; v < x_.size(); ++v) {
    x_[v] = last_[v] + constants_.prediction * (last_[v] - before_[v]);
  }
}

/// Which vertices the sensors can see. It changes little while X moves by few edges, so it is found
/// only where X has just been predicted, or moved as a whole.
void SurfaceTracking::look(const Measurement& measurement) {
  find_vertex_normals(faces_, x_, normals_);
  visibility_.find(faces_, x_, normals_, measurement.viewpoints(), constants_.pixel * mean_edge_,
                   constants_.thickness * mean_edge_, seen_);
}

/// Finds the points of every `stride`th of the vertices that the sensors can see.
SurfaceTracking::Tally SurfaceTracking::correspond(const Measurement& measurement,
                                                   const Search& search) {
  find_vertex_normals(faces_, x_, normals_);
  const double scale = search.scale * mean_edge_;
  const double side = search.side * mean_edge_;
  workers_.for_each_short_chunk(static_cast<Index>(x_.size()), [&](Index first, Index last) {
    std::uint32_t near_by = Measurement::no_guess;  // the point of an earlier vertex
    for (auto v = static_cast<std::size_t>(first); v < static_cast<std::size_t>(last); ++v) {
      Correspondence& c = found_[v];
      c = {};
      if (seen_[v] == 0 || v % search.stride != 0) continue;
      const std::uint32_t guess = guesses_[v] == Measurement::no_guess ? near_by : guesses_[v];
      if (search.takes_any && is_near(measurement, guess, v, search.radius)) {
        c = {measurement.point(guess), measurement.normal(guess), 1, guess};
        continue;
      }
      c = measurement.nearest(x_[v], normals_[v], search.radius * mean_edge_, constants_.agreement,
                              guess);
      if (c.weight == 0) continue;
      near_by = guesses_[v] = c.number;
      const auto offset = c.point - x_[v];
      const double distance = squared_norm(offset);
      const double ahead = dot(offset, c.normal);
      const double aside = distance - ahead * ahead;
      c.weight = search.weight / ((1 + distance / (scale * scale)) * (1 + aside / (side * side)));
    }
  });
  Tally tally;
  for (std::size_t v = 0; v < x_.size(); ++v) {
    tally.seen += seen_[v];
    if (!(found_[v].weight > 0)) continue;
    ++tally.found;
    vertices_near_[found_[v].number] = static_cast<std::uint32_t>(v);
  }
  return tally;
}

/// Whether a measured point is within some mean edges of a vertex, and their normals agree.
bool SurfaceTracking::is_near(const Measurement& measurement, std::uint32_t point, std::size_t v,
                              double radius) const {
  if (point == Measurement::no_guess || v >= x_.size()) return false;
  const double reach = radius * mean_edge_;
  if (!(squared_norm(measurement.point(point) - x_[v]) < reach * reach)) return false;
  const double cosine = dot(measurement.normal(point), normals_[v]);
  return (measurement.is_undecided(point) ? std::abs(cosine) : cosine) >= constants_.agreement;
}

/// A rigid motion has six unknowns, so some of the vertices are enough.
std::size_t SurfaceTracking::rigid_stride() const {
  return 1 + x_.size() / static_cast<std::size_t>(constants_.rigid_vertices);
}

void SurfaceTracking::move_as_a_whole(const Measurement& measurement, const Search& search) {
  if (correspond(measurement, search).found < static_cast<std::size_t>(constants_.least_rigid))
    return;
  move_rigidly(fit_to_planes(x_, found_, constants_.rigid_caution), x_);
}

bool SurfaceTracking::lies_in(const Measurement& measurement, double share) {
  const Search search = {constants_.wide_radius, constants_.scale, constants_.side, 1};
  look(measurement);
  const Tally tally = correspond(measurement, search);
  const std::size_t most = std::min(tally.seen, measurement.size());
  return tally.found > 0 && static_cast<double>(tally.found) >= share * static_cast<double>(most);
}

/// If the template is not where the first measurement is, moves it there. Returns whether that was
/// needed. Throws std::invalid_argument if it was not possible.
bool SurfaceTracking::align(const Measurement& measurement) {
  if (lies_in(measurement, constants_.least_found)) return false;
  // The sum of few points is enough.
  const std::size_t stride = 1 + measurement.size() / 4096;
  Vector3<double> measured;
  double n_measured = 0;
  for (std::size_t i = 0; i < measurement.size(); i += stride) {
    measured = measured + measurement.point(i);
    n_measured += 1;
  }
  Vector3<double> seen;
  double n_seen = 0;
  for (std::size_t v = 0; v < x_.size(); ++v) {
    if (seen_[v] == 0) continue;
    seen = seen + x_[v];
    n_seen += 1;
  }
  const auto shift = (1 / n_measured) * measured - (1 / std::max(n_seen, 1.0)) * seen;
  double reach = 0;
  for (const auto& x : x_) reach = std::max(reach, std::sqrt(squared_norm(x - x_[0])));
  for (auto& x : x_) x = x + shift;
  // From half the size of the template down to the radius of the passes.
  const double widest = std::max(0.5 * reach / mean_edge_, constants_.rigid_radius);
  for (int step = 0; step < constants_.alignment_steps; ++step) {
    const double progress = static_cast<double>(step) / constants_.alignment_steps;
    const double radius = widest * std::pow(constants_.rigid_radius / widest, progress);
    look(measurement);
    move_as_a_whole(measurement, {radius, radius, radius, 1, rigid_stride()});
  }
  const bool is_enough = measurement.size() >= static_cast<std::size_t>(constants_.least_rigid);
  if (is_enough && lies_in(measurement, constants_.least_aligned)) return true;
  const double distance = std::sqrt(squared_norm(shift));
  std::array<char, 320> text{};
  (void)std::snprintf(text.data(), text.size(),
                      "points: the template is far from the first scan: their centres are %.4g "
                      "apart, %.4g mean edges of the template, and no rigid alignment was found; "
                      "both must be in the same axes and unit of length, and the template in the "
                      "pose of the scan",
                      distance, distance / mean_edge_);
  throw std::invalid_argument(text.data());
}

/// The share of the vertices that a sensor should see and that have no point within some mean
/// edges.
double SurfaceTracking::share_without_point(double distance) const {
  const double reach = distance * mean_edge_;
  double n_seen = 0;
  double n_without = 0;
  for (std::size_t v = 0; v < x_.size(); ++v) {
    if (seen_[v] == 0) continue;
    n_seen += 1;
    const Correspondence& c = found_[v];
    const bool is_near = c.weight > 0 && squared_norm(c.point - x_[v]) < reach * reach;
    n_without += is_near ? 0 : 1;
  }
  return n_seen > 0 ? n_without / n_seen : 0;
}

/// Measured points that are far from all vertices draw the nearest one: so a limb that lies on the
/// wrong one comes back. Returns their share.
double SurfaceTracking::draw_towards_unexplained(const Measurement& measurement, double weight) {
  vertices_.points.assign(x_.begin(), x_.end());
  vertices_.normals.assign(normals_.begin(), normals_.end());
  vertices_.index();
  std::ranges::fill(drawn_, Correspondence{});
  const double radius = constants_.drawing_radius * mean_edge_;
  const double least = constants_.least_unexplained * mean_edge_;
  const std::size_t stride =
      1 + measurement.size() / static_cast<std::size_t>(constants_.looked_at);
  double n_near = 0;
  double n_unexplained = 0;
  for (std::size_t i = 0; i < measurement.size(); i += stride) {
    if (is_near(measurement, static_cast<std::uint32_t>(i), vertices_near_[i],
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
    if (seen_[nearest.index] == 0) continue;
    if (own.weight > 0 && squared_norm(own.point - x_[nearest.index]) < least * least) continue;
    n_unexplained += 1;
    Correspondence& drawn = drawn_[nearest.index];
    drawn.point = drawn.point + point;
    drawn.normal = drawn.normal + normal;
    drawn.weight += 1;
  }
  const double unexplained = n_near > 0 ? n_unexplained / n_near : 0;
  if (unexplained > constants_.largest_limb + share_without_point(constants_.least_unexplained)) {
    return 0;
  }
  const double scale = constants_.drawing_scale * mean_edge_;
  for (std::size_t v = 0; v < x_.size(); ++v) {
    const Correspondence& drawn = drawn_[v];
    const double length = std::sqrt(squared_norm(drawn.normal));
    if (!(length > 0)) continue;
    const auto point = (1 / drawn.weight) * drawn.point;
    const double distance = squared_norm(point - x_[v]);
    found_[v] = {point, (1 / length) * drawn.normal,
                 constants_.drawing_weight * weight / (1 + distance / (scale * scale)), 0};
  }
  return unexplained;
}

/// Chooses the components with enough correspondences, of which those that are far away count less:
/// `weight` is that of one without any distance. Returns whether there is any.
bool SurfaceTracking::choose_components(double weight) {
  std::ranges::fill(found_in_, 0.0);
  for (std::size_t v = 0; v < found_.size(); ++v) {
    found_in_[static_cast<std::size_t>(topology_.component[v])] += found_[v].weight / weight;
  }
  anchors_.n_solved = 0;
  bool is_the_same = is_factored_;
  for (std::size_t v = 0; v < found_.size(); ++v) {
    const bool is_solved =
        found_in_[static_cast<std::size_t>(topology_.component[v])] >= constants_.fewest;
    is_the_same = is_the_same && (anchors_.is_solved[v] != 0) == is_solved;
    anchors_.is_solved[v] = is_solved ? 1 : 0;
    if (!is_solved) found_[v].weight = 0;
    anchors_.n_solved += is_solved ? 1 : 0;
  }
  if (anchors_.n_solved == 0) return false;
  if (!is_the_same) {
    for (std::size_t v = 0; v < found_.size(); ++v) anchors_.weights[v] = found_[v].weight;
    system_.factorize(anchors_);
    is_factored_ = true;
  }
  return true;
}

/// The weight of a correspondence, from the first pass to the last.
double SurfaceTracking::weight_at(double progress) const {
  return constants_.first_weight *
         std::pow(constants_.last_weight / constants_.first_weight, progress);
}

/// Repeats the first pass until nearly all measured points are explained. Returns how often.
int SurfaceTracking::search(const Measurement& measurement) {
  for (int done = 0;; ++done) {
    if (done > 0) look(measurement);
    const double unexplained = bend(measurement, weight_at(0), true);
    if (unexplained <= constants_.lost_share || done + 1 >= constants_.most_searches) {
      return done + 1;
    }
  }
}

/// Finds correspondences and rotations for X, and then X for these. Returns the share of the
/// measured points that no vertex explains, in early passes.
double SurfaceTracking::bend(const Measurement& measurement, double weight, bool is_early,
                             bool poses) {
  const double radius = is_early ? constants_.wide_radius : constants_.narrow_radius;
  correspond(measurement, {radius, constants_.scale, constants_.side, weight});
  const double lost = is_early ? draw_towards_unexplained(measurement, weight) : 0;
  if (!choose_components(weight)) return 0;
  rotations_.fit_widely(x_);
  if (poses && rest_.is_rehearsed()) pose();
  for (std::size_t v = 0; v < x_.size(); ++v) {
    wanted_[v] = shape_[v] + constants_.pull * (rest_.shape()[v] - shape_[v]);
  }
  rotations_.turn(wanted_, turned_);
  fit_.take_steps(system_, turned_, found_, constants_.steps, x_);
  return lost;
}

/// The correspondences as anchors: each says how far a vertex is from a plane.
void SurfaceTracking::observe_planes() {
  anchors_.number = 0;
  for (std::size_t v = 0; v < x_.size(); ++v) {
    const Correspondence& c = found_[v];
    anchors_.counts[v] = anchors_.is_solved[v];
    anchors_.observed[v] = x_[v] + dot(c.normal, c.point - x_[v]) * c.normal;
    anchors_.weights[v] = c.weight;
    anchors_.number += c.weight > 0 ? 1 : 0;
  }
}

/// Poses the rest shape by the correspondences. Each anchor is the point of its plane that is
/// nearest to the vertex. The factor is that of the present weights meanwhile, and then again the
/// preconditioner of the frame, so that a rehearsal that is not trusted changes nothing.
void SurfaceTracking::pose() {
  std::ranges::copy(anchors_.weights, factored_weights_.begin());
  observe_planes();
  system_.factorize(anchors_);
  rest_.pose({x_, shape_, anchors_}, system_, rotations_);
  std::ranges::copy(factored_weights_, anchors_.weights.begin());
  system_.factorize(anchors_);
}

/// Which vertices have a measured point in the end.
SurfaceTracking::Found SurfaceTracking::observe(const Measurement& measurement) {
  if (error_bars_.exist() && anchors_.any_solved()) {
    observe_planes();
    system_.factorize(anchors_);
    std::ranges::transform(found_, planes_.begin(), &Correspondence::normal);
  }
  correspond(measurement,
             {constants_.observed_distance, constants_.scale, constants_.side, 1, 1, true});
  Found result = {x_, observed_, 0, 0, false};
  double sum = 0;
  double n = 0;
  for (std::size_t v = 0; v < x_.size(); ++v) {
    observed_[v] = anchors_.is_solved[v] != 0 && found_[v].weight > 0 ? 1 : 0;
    if (observed_[v] == 0) continue;
    const double distance = dot(found_[v].normal, found_[v].point - x_[v]);
    sum += distance * distance;
    n += 1;
  }
  if (n > 0) result.distance = std::sqrt(sum / n);
  return result;
}

void SurfaceTracking::measure_errors(const Generations& generations) {
  if (!error_bars_.exist()) return;
  if (!anchors_.any_solved()) {
    error_bars_.pass(generations, rotations_);
    return;
  }
  system_.apply(x_, 1, kx_);
  anchors_.normals = planes_;
  error_bars_.update({x_, kx_, turned_}, 0, anchors_, generations, system_, rotations_);
  anchors_.normals = {};
}

void SurfaceTracking::remember(Field completed, bool moves) {
  std::ranges::copy(moves ? Field(last_) : completed, before_.begin());
  std::ranges::copy(completed, last_.begin());
  if (moves) is_first_ = false;
  rotations_.fit_widely(last_);
  system_.apply(last_, 1, wanted_);
  rotations_.turn_back(wanted_, shape_);
}

void SurfaceTracking::recall(Field last, Field before, std::span<const Quaternion> rotations,
                             bool is_first) {
  std::ranges::copy(last, last_.begin());
  std::ranges::copy(before, before_.begin());
  std::ranges::copy(rotations, rotations_.quaternions().begin());
  system_.apply(last_, 1, wanted_);
  rotations_.turn_back(wanted_, shape_);
  is_first_ = is_first;
}

}  // namespace dynmesh
