#include "surface_fit/nonrigid_step.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "base/geometry.hpp"
#include "base/statistics.hpp"
#include "shape/shape_system.hpp"
#include "surface_fit/plane_anchors.hpp"

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

/// (k,) W, for which the step is that of iteratively reweighted least squares. Vertices without
/// edges, which never depart, do not show what is usual.
std::vector<double> resistance_against(Field departures, double yields_beyond) {
  if (std::isinf(yields_beyond)) return std::vector<double>(departures.size(), 1.0);
  std::vector<double> lengths;
  for (const auto& departure : departures) lengths.push_back(std::sqrt(squared_norm(departure)));
  auto usual = lengths;
  std::erase(usual, 0.0);
  const double limit = usual.empty() ? 0 : yields_beyond * quantile(std::move(usual), 0.5);
  std::vector<double> resistance;
  for (const double length : lengths) resistance.push_back(length > limit ? limit / length : 1);
  return resistance;
}

}  // namespace

// No coefficient is kept that the points do not determine: the shape of the last frame keeps hidden
// parts as they were, and modes that keep them as well would confirm what was found wrongly.
NonrigidStep::NonrigidStep(const ShapeModel& model, std::span<const Triangle> faces,
                           Workers& workers, const TrackingConstants& constants,
                           std::span<const Material> materials)
    : model_(model),
      workers_(workers),
      constants_(constants),
      materials_(materials),
      rotations_(model.surroundings, workers),
      fit_(ShapeFit::Of::rest, model.topology.cells, workers, 0, model.modes),
      ties_(model.topology, model.first_frame, outward_normals(model, faces, materials),
            model.mean_edge, constants),
      surface_system_(model, membrane_of(model.topology.component, materials), constants,
                      ties_.all(), workers),
      membrane_(faces, model.first_frame, model.mean_edge, surface_system_.membrane(), workers) {}

void NonrigidStep::begin(Memory& memory) const {
  memory.q.assign(model_.size(), {1, 0, 0, 0});
  memory.m = model_.first_shape;
  memory.sizes.assign(model_.topology.report.components, 1);
  if (model_.is_trained) memory.fit.coefficients = ShapeFit::no_coefficients();
  memory.departures = ties_.no_departures();
}

WeightedTies NonrigidStep::turn_to(Field x, std::span<const double> departures, Memory& next) {
  rotations_.fit(x, next.q);
  return ties_.weighted(ties_.departed(x, next.q, departures));
}

bool NonrigidStep::step(const StepInput& input, MaskedFactor& preconditioner, Field m,
                        std::span<Vector3> x, Memory& next) {
  if (input.rows.empty() && input.landmarks.empty()) return false;
  if (input.mode_weights > 0 && fit_.exists()) fit_modes(input, preconditioner, m, x, next);
  const auto wanted = wanted_shape(m, next);
  std::vector<Vector3> departures(x.size());  // Q m - K X
  apply_operator(model_.k, x, 1, departures, workers_);
  for (std::size_t v = 0; v < x.size(); ++v) departures[v] = wanted[v] - departures[v];
  const auto resistance = resistance_against(departures, input.yields_beyond);
  auto force = forces(x, departures, resistance, input.ties, next.q);
  surface_system_.solve(input, preconditioner, resistance, input.solution, x, force);
  return true;
}

std::vector<Vector3> NonrigidStep::wanted_shape(Field last, const Memory& next) {
  auto shape = rest_shape(next);
  for (std::size_t v = 0; v < shape.size(); ++v) {
    const double pull = materials_[at(model_.topology.component[v])].pull;
    shape[v] = last[v] + pull * (shape[v] - last[v]);
  }
  turn(next.q, shape, shape, workers_);
  return shape;
}

/// (k,) half of the negative gradient of the energies of the shape, the membrane and the ties.
std::vector<Vector3> NonrigidStep::forces(Field x, Field departures,
                                          std::span<const double> resistance,
                                          std::span<const Tie> ties,
                                          std::span<const Quaternion> q) {
  std::vector<Vector3> force(x.size());
  surface_system_.pull_back(resistance, departures, force);
  membrane_.add_forces(x, force);
  for (const Tie& tie : ties) {
    const auto pull = tie.weight * (LearnedTies::kept(tie, q) - (x[tie.i] - x[tie.j]));
    force[tie.i] = force[tie.i] + pull;
    force[tie.j] = force[tie.j] - pull;
  }
  return force;
}

/// Fits the rest shape by the points, with a factor of its own.
void NonrigidStep::fit_modes(const StepInput& input, const MaskedFactor& preconditioner, Field m,
                             Field x, Memory& next) {
  PlaneAnchors planes(input.rows, x, model_.topology);
  if (planes.anchors.number == 0) return;
  for (double& weight : planes.anchors.weights) weight *= input.mode_weights;
  ShapeSystem system(model_.k, workers_);
  Lender<MaskedFactor> factors(MaskedFactor(preconditioner.plan(), workers_));
  ShapeFactor factor(planes.anchors, factors.lend());
  std::vector<Vector3> kx(x.size());
  std::vector<ShapeTerms> wanted(x.size()), steps(x.size()), k_steps(x.size());
  for (std::size_t v = 0; v < x.size(); ++v) wanted[v] = {m[v], grown(v, next) - m[v], {}};
  turn(next.q, wanted, wanted, workers_);
  system.apply(x, 1, kx);
  system.solve_terms(wanted, x, kx, factor, steps);
  system.apply(steps, k_steps);
  const double rounding = model_.rounding.mean_square(x);
  fit_.find({planes.anchors, x, kx, wanted, steps, k_steps, rounding}, factor, system, next.q,
            next.fit);
}

std::vector<Vector3> NonrigidStep::rest_shape(const Memory& memory) {
  std::vector<Vector3> rest;
  for (std::size_t v = 0; v < model_.size(); ++v) rest.push_back(grown(v, memory));
  if (memory.fit.prior_weight == 0) return rest;
  const auto added = fit_.shape_of(memory.fit);
  for (std::size_t v = 0; v < rest.size(); ++v) {
    rest[v] = rest[v] + memory.fit.prior_weight * added[v];
  }
  return rest;
}

void NonrigidStep::remember(Field frame, Memory& memory) {
  rotations_.fit(frame, memory.q);
  std::vector<Vector3> shape(model_.size());
  apply_operator(model_.k, frame, 1, shape, workers_);
  turn_back(memory.q, shape, memory.m, workers_);
}

}  // namespace dynmesh
