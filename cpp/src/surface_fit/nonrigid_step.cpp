#include "surface_fit/nonrigid_step.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "base/geometry.hpp"
#include "base/statistics.hpp"
#include "surface_fit/point_scan.hpp"

namespace dynmesh {
namespace {

/// (k,) mu.
std::vector<double> membrane_of(std::span<const Index> component,
                                std::span<const Material> materials) {
  std::vector<double> mu;
  for (const Index of : component) mu.push_back(materials[of].membrane);
  return mu;
}

/// (k,) of frame 0; 0 on sheets, which have no inside.
std::vector<Vector3> outward_normals(const ShapeModel& model, std::span<const Triangle> faces,
                                     std::span<const Material> materials) {
  const auto outside = find_outsides(faces, model.topology, model.first_frame, model.mean_edge);
  auto normals = vertex_normals(faces, model.first_frame);
  for (std::size_t v = 0; v < normals.size(); ++v) {
    const std::size_t component = at(model.topology.component[v]);
    normals[v] = materials[component].is_sheet ? Vector3{} : outside[component] * normals[v];
  }
  return normals;
}

/// The membrane of cloth holds it where it has no points, and the equations of the ensemble leave
/// it out: residuals then do not tell what they are due to.
AnchorNoise noise_of_points(std::span<const Material> materials) {
  const bool any_slides = std::ranges::any_of(materials, &Material::slides);
  return any_slides ? AnchorNoise::by_weight : AnchorNoise::of_planes;
}

}  // namespace

// No coefficient is kept that the points do not determine: the shape of the last frame keeps hidden
// parts as they were, and modes that keep them as well would confirm what was found wrongly.
NonrigidStep::NonrigidStep(const ShapeModel& model, std::span<const Triangle> faces,
                           Workers& workers, const TrackingConstants& constants,
                           std::span<const Material> materials, bool has_uncertainty)
    : model_(model),
      topology_(model.topology),
      workers_(workers),
      materials_(materials),
      rotations_(model.surroundings, workers),
      fit_(ShapeFit::Of::rest, topology_.cells, workers, 0, model.modes),
      error_bars_(topology_.cells, workers, has_uncertainty, noise_of_points(materials)),
      ties_(topology_, model.first_frame, outward_normals(model, faces, materials), model.mean_edge,
            constants),
      surface_system_(model, membrane_of(topology_.component, materials), constants, ties_.all(),
                      workers),
      membrane_(faces, model.first_frame, model.mean_edge, surface_system_.membrane(), workers),
      anchors_(model.size(), true),
      rest_(model.first_shape),
      wanted_(model.size()),
      turned_(model.size()),
      kx_(model.size()),
      planes_(model.size()),
      forces_(model.size()) {
  if (!fit_.exists() && !error_bars_.exist()) return;
  of_planes_.emplace(model.k, surface_system_.plan(), workers);
  of_planes_->take_planes(constants.steps);
}

void NonrigidStep::begin(Memory& memory) const {
  memory.q.assign(model_.size(), {1, 0, 0, 0});
  memory.m = model_.first_shape;
  if (model_.is_trained) memory.fit.coefficients = ShapeFit::no_coefficients();
  memory.errors = error_bars_.no_errors();
  memory.departures = ties_.no_departures();
}

void NonrigidStep::turn_to(Field x, std::span<const double> departures, Memory& next) {
  rotations_.fit(x, next.q);
  ties_.set_weights(ties_.departed(x, next.q, departures));
}

bool NonrigidStep::take(const Draw& draw, Field m, std::span<Vector3> x, Memory& next) {
  if (draw.rows.empty() && draw.landmarks.empty()) return false;
  if (draw.mode_weights > 0 && fit_.exists()) fit_modes(draw, m, x, next);
  for (std::size_t v = 0; v < x.size(); ++v) {
    const double pull = materials_[topology_.component[v]].pull;
    wanted_[v] = m[v] + pull * (rest_[v] - m[v]);
  }
  turn(next.q, wanted_, turned_, workers_);
  find_forces(x, next.q, draw.yields_beyond);
  surface_system_.solve(draw.rows, draw.landmarks, draw.settled, x, forces_);
  return true;
}

/// Half of the negative gradient of the energies of the shape, the membrane and the ties.
void NonrigidStep::find_forces(Field x, std::span<const Quaternion> q, double yields_beyond) {
  apply_operator(model_.k, x, 1, kx_, workers_);
  for (std::size_t v = 0; v < x.size(); ++v) kx_[v] = turned_[v] - kx_[v];
  find_resistance(yields_beyond);
  surface_system_.pull_back(kx_, forces_);
  membrane_.add_forces(x, forces_);
  for (const Tie& tie : ties_.all()) {
    const auto force = tie.weight * (LearnedTies::kept(tie, q) - (x[tie.i] - x[tie.j]));
    forces_[tie.i] = forces_[tie.i] + force;
    forces_[tie.j] = forces_[tie.j] - force;
  }
}

/// W, for which the step is that of iteratively reweighted least squares. Vertices without edges,
/// which never depart, do not tell what is usual.
void NonrigidStep::find_resistance(double yields_beyond) {
  if (std::isinf(yields_beyond)) {
    std::ranges::fill(surface_system_.resistance(), 1.0);
    return;
  }
  std::vector<double> departures;
  for (const auto& departure : kx_) departures.push_back(std::sqrt(squared_norm(departure)));
  auto usual = departures;
  std::erase(usual, 0.0);
  const double limit = usual.empty() ? 0 : yields_beyond * quantile(std::move(usual), 0.5);
  for (std::size_t v = 0; v < departures.size(); ++v) {
    surface_system_.resistance()[v] = departures[v] > limit ? limit / departures[v] : 1;
  }
}

/// The rows as anchors, one for each vertex that they touch: the point of their mean plane that is
/// nearest to the vertex.
void NonrigidStep::observe_planes(std::span<const SurfaceRow> rows, Field x) {
  std::vector<std::uint8_t> is_drawn(topology_.report.components);
  const auto component = [&](std::size_t v) { return at(topology_.component[v]); };
  std::vector<double> along(x.size());
  std::ranges::fill(planes_, Vector3{});
  std::ranges::fill(anchors_.weights, 0.0);
  for (const SurfaceRow& row : rows) {
    is_drawn[component(row.corners[0])] = 1;
    const double distance = dot(row.normal, row.point - row.on(x));
    for (std::size_t s = 0; s < 3; ++s) {
      const auto v = row.corners[s];
      const double weight = row.weight * row.shares[s];
      anchors_.weights[v] += weight;
      along[v] += weight * distance;
      planes_[v] = planes_[v] + weight * row.normal;
    }
  }
  anchors_.number = 0;
  anchors_.n_solved = 0;
  for (std::size_t v = 0; v < x.size(); ++v) {
    const double length = std::sqrt(squared_norm(planes_[v]));
    const bool is_seen = anchors_.weights[v] > 0 && length > 0;
    planes_[v] = is_seen ? (1 / length) * planes_[v] : Vector3{};
    anchors_.observed[v] = is_seen ? x[v] + (along[v] / anchors_.weights[v]) * planes_[v] : x[v];
    if (!is_seen) anchors_.weights[v] = 0;
    anchors_.is_solved[v] = is_drawn[component(v)];
    anchors_.counts[v] = is_drawn[component(v)];
    anchors_.number += is_seen ? 1 : 0;
    anchors_.n_solved += is_drawn[component(v)];
  }
}

/// Fits the rest shape by the points.
void NonrigidStep::fit_modes(const Draw& draw, Field m, Field x, Memory& next) {
  observe_planes(draw.rows, x);
  for (double& weight : anchors_.weights) weight *= draw.mode_weights;
  if (anchors_.number == 0) return;
  ShapeSystem& system = *of_planes_;
  system.factorize(anchors_);
  std::vector<ShapeTerms> wanted(x.size()), steps(x.size()), k_steps(x.size());
  for (std::size_t v = 0; v < x.size(); ++v) wanted[v] = {m[v], model_.first_shape[v] - m[v], {}};
  turn(next.q, wanted, wanted, workers_);
  system.apply(x, 1, kx_);
  system.solve_terms(wanted, x, kx_, anchors_, steps);
  system.apply(steps, k_steps);
  const double rounding = model_.rounding.mean_square(x);
  fit_.find({anchors_, x, kx_, wanted, steps, k_steps, rounding}, system, next.q, next.fit);
  find_rest_shape(next.fit);
}

void NonrigidStep::find_rest_shape(const FitMemory& fit) {
  rest_ = model_.first_shape;
  if (fit.prior_weight == 0) return;
  const LentField added = fit_.shape_of(fit);
  for (std::size_t v = 0; v < rest_.size(); ++v) {
    rest_[v] = model_.first_shape[v] + fit.prior_weight * added[v];
  }
}

void NonrigidStep::prepare_errors(std::span<const SurfaceRow> rows, Field x) {
  if (!error_bars_.exist()) return;
  observe_planes(rows, x);
  if (anchors_.any_solved()) of_planes_->factorize(anchors_);
}

void NonrigidStep::measure_errors(const Memory& memory, Field x, double unseen, Memory& next) {
  if (!error_bars_.exist()) return;
  if (!anchors_.any_solved()) {
    error_bars_.pass(next.generations, model_.clusters(), memory.errors, next.errors);
    return;
  }
  of_planes_->apply(x, 1, kx_);
  anchors_.normals = planes_;
  error_bars_.update({x, kx_, turned_, model_.rounding.mean_square(x)}, anchors_, next.generations,
                     *of_planes_, model_.clusters(), memory.errors, next.errors);
  ErrorBars::widen(next.generations, unseen, next.errors);
  anchors_.normals = {};
}

void NonrigidStep::remember(Field frame, Memory& memory) {
  rotations_.fit(frame, memory.q);
  apply_operator(model_.k, frame, 1, wanted_, workers_);
  turn_back(memory.q, wanted_, memory.m, workers_);
}

}  // namespace dynmesh
