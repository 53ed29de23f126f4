#include "tracking/surface_tracking.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "support/geometry.hpp"

namespace dynmesh {
namespace {

DetailConstants constants_for(const TrackingConstants& tracking) {
  DetailConstants constants;
  constants.training.largest_kept = tracking.largest_kept;
  return constants;
}

}  // namespace

SurfaceTracking::SurfaceTracking(std::vector<Triangle> faces, const Topology& topology,
                                 Workers& workers, const TrackingConstants& constants,
                                 TrainingFrames<double> training, bool has_uncertainty,
                                 double epsilon)
    : constants_(constants),
      detail_constants_(constants_for(constants)),
      faces_(std::move(faces)),
      topology_(topology),
      workers_(workers),
      system_(topology.cells, workers),
      rotations_(topology.cells, workers),
      fit_(topology.cells.size()),
      visibility_(topology.cells.size()),
      is_sheet_(find_sheets(faces_, topology.component)),
      epsilon_(epsilon),
      rest_(topology.cells, workers, detail_constants_, std::move(training)),
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
      factored_weights_(rest_.is_trained() ? topology.cells.size() : 0),
      kx_(has_uncertainty ? topology.cells.size() : 0),
      planes_(kx_.size()) {
  if (has_uncertainty) system_.take_planes(constants.steps);
}

void SurfaceTracking::reset(Field first_frame) {
  auto prepared = system_.prepare<double>(faces_, first_frame, detail_constants_);
  auto prepared_rotations = rotations_.prepare(first_frame);
  const double mean_edge = mean_edge_length(topology_.cells, first_frame);
  const Rounding rounding(prepared.k, mean_edge, epsilon_);
  rest_.reset(rest_.learn(prepared.k, first_frame, mean_edge, rounding));
  // Nothing below can throw.
  system_.reset(std::move(prepared));
  mean_edge_ = mean_edge;
  rounding_ = rounding;
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
    find_visible(measurement);
    const double scale = constants_.rigid_scale;
    for (int step = 0; step < constants_.rigid_steps; ++step) {
      move_as_a_whole(measurement, {constants_.rigid_radius, scale, scale, 1, rigid_stride()});
    }
    const int searches = search(measurement);
    for (int i = 1; i < constants_.iterations; ++i) {
      const double progress = static_cast<double>(i) / (constants_.iterations - 1);
      nonrigid_step(measurement, weight_at(progress), 2 * i < constants_.iterations,
                    i == constants_.fitting_iteration);
    }
    Found result = observe(measurement);
    result.iterations = searches + constants_.iterations - 1;
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

/// The weight of a correspondence, from the first iteration to the last.
double SurfaceTracking::weight_at(double progress) const {
  return constants_.first_weight *
         std::pow(constants_.last_weight / constants_.first_weight, progress);
}

/// Repeats the first iteration until nearly all measured points are explained. Returns how often.
int SurfaceTracking::search(const Measurement& measurement) {
  for (int done = 0;; ++done) {
    if (done > 0) find_visible(measurement);
    const double unexplained = nonrigid_step(measurement, weight_at(0), true);
    if (unexplained <= constants_.lost_share || done + 1 >= constants_.most_searches) {
      return done + 1;
    }
  }
}

/// Finds correspondences and rotations for X, and then X for these. Returns the share of the
/// measured points that no vertex explains, in early iterations.
double SurfaceTracking::nonrigid_step(const Measurement& measurement, double weight, bool is_early,
                                      bool poses) {
  const double radius = is_early ? constants_.wide_radius : constants_.narrow_radius;
  correspond(measurement, {radius, constants_.scale, constants_.side, weight});
  const double lost = is_early ? draw_towards_unexplained(measurement, weight) : 0;
  if (!choose_components(weight)) return 0;
  rotations_.fit_widely(x_);
  if (poses && rest_.is_trained()) pose();
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

/// Fits the rest shape by the correspondences. Each anchor is the point of its plane that is
/// nearest to the vertex. The factor is that of the present weights meanwhile, and then again the
/// preconditioner of the frame, so that a training sequence that is not used changes nothing.
void SurfaceTracking::pose() {
  std::ranges::copy(anchors_.weights, factored_weights_.begin());
  observe_planes();
  system_.factorize(anchors_);
  rest_.pose({x_, shape_, anchors_, rounding_.mean_square<double>(x_)}, system_, rotations_);
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
  error_bars_.update({x_, kx_, turned_, rounding_.mean_square<double>(x_)}, 0, anchors_,
                     generations, system_, rotations_);
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
