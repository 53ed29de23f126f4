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

std::vector<Vector3<double>> shape_of(std::span<const Vector3<double>> first_frame,
                                      const ShapeSystem& system) {
  std::vector<Vector3<double>> shape(first_frame.size());
  system.apply(first_frame, 1, shape);
  return shape;
}

/// The membrane of cloth holds it where it has no points, and the equations of the ensemble leave
/// it out: residuals then do not tell what they are due to.
AnchorNoise noise_of_points(std::span<const Material> materials) {
  const bool any_slides = std::ranges::any_of(materials, &Material::slides);
  return any_slides ? AnchorNoise::by_weight : AnchorNoise::of_planes;
}

}  // namespace

NonrigidStep::NonrigidStep(std::span<const Triangle> faces, const Topology& topology,
                           Workers& workers, const TrackingConstants& constants, Field first_frame,
                           double mean_edge, std::span<const Material> materials,
                           const TrainingFrames& training, bool has_uncertainty, double epsilon)
    : topology_(topology),
      materials_(materials),
      system_(faces, topology.cells, workers, first_frame,
              membrane_of(topology.component, materials)),
      rotations_(topology.cells, workers, first_frame, mean_edge),
      rounding_(system_.k(), mean_edge, epsilon),
      shape_(shape_of(first_frame, system_)),
      rest_(topology.cells, workers, !training.empty(),
            training_modes(training, system_.k(), topology.cells, first_frame, mean_edge, rounding_,
                           workers),
            shape_),
      error_bars_(topology.cells, workers, has_uncertainty, noise_of_points(materials)),
      membrane_(faces, first_frame, mean_edge, system_.membrane(), workers),
      surface_system_(system_, topology.cells, constants,
                      find_ties(topology, first_frame, mean_edge, constants.tie_weight),
                      first_frame, rotations_.clusters(), workers),
      anchors_(first_frame.size(), true),
      wanted_(first_frame.size()),
      turned_(first_frame.size()),
      kx_(first_frame.size()),
      planes_(first_frame.size()),
      forces_(first_frame.size()) {
  system_.take_planes(constants.steps);
  keep();
}

/// They are always as many, so this allocates, and can throw, in the constructor only.
void NonrigidStep::keep() {
  remembered_.clear();
  fields(*this, [&](const auto& visited) {
    const auto numbers = numbers_of(visited);
    remembered_.insert(remembered_.end(), numbers.begin(), numbers.end());
  });
}

void NonrigidStep::begin_frame() {
  auto number = remembered_.begin();
  fields(*this, [&](auto&& visited) {
    for (double& x : numbers_of(visited)) x = *number++;
  });
  rest_.recall();
}

bool NonrigidStep::take(std::span<const SurfaceRow> rows, std::span<const Landmark> landmarks,
                        double mode_weights, std::span<Vector3<double>> x) {
  if (rows.empty() && landmarks.empty()) return false;
  rotations_.fit(x);
  if (mode_weights > 0 && rest_.is_trained()) {
    fit_modes(rows, mode_weights, x);
    surface_system_.factorize_again();
  }
  for (std::size_t v = 0; v < x.size(); ++v) {
    const double pull = materials_[topology_.component[v]].pull;
    wanted_[v] = shape_[v] + pull * (rest_.shape()[v] - shape_[v]);
  }
  rotations_.turn(wanted_, turned_);
  find_forces(x);
  surface_system_.solve(rows, landmarks, x, forces_);
  return true;
}

/// Half of the negative gradient of the energies of the shape, the membrane and the ties.
void NonrigidStep::find_forces(Field x) {
  system_.apply(x, 1, kx_);
  for (std::size_t v = 0; v < x.size(); ++v) kx_[v] = turned_[v] - kx_[v];
  find_resistance();
  system_.apply_transposed(kx_, forces_);
  membrane_.add_forces(x, forces_);
  for (const Tie& tie : surface_system_.ties()) {
    const auto turned = 0.5 * (rotated(rotations_.quaternions()[tie.i], tie.kept) +
                               rotated(rotations_.quaternions()[tie.j], tie.kept));
    const auto force = tie.weight * (turned - (x[tie.i] - x[tie.j]));
    forces_[tie.i] = forces_[tie.i] + force;
    forces_[tie.j] = forces_[tie.j] - force;
  }
}

/// W, for which the step is that of iteratively reweighted least squares. Vertices without edges,
/// which never depart, do not tell what is usual.
void NonrigidStep::find_resistance() {
  if (std::isinf(yield_beyond_)) return;
  std::vector<double> departures;
  for (const auto& departure : kx_) departures.push_back(std::sqrt(squared_norm(departure)));
  auto usual = departures;
  std::erase(usual, 0.0);
  const double limit = usual.empty() ? 0 : yield_beyond_ * quantile(std::move(usual), 0.5);
  for (std::size_t v = 0; v < departures.size(); ++v) {
    system_.resistance()[v] = departures[v] > limit ? limit / departures[v] : 1;
  }
}

/// The rows as anchors, one for each vertex that they touch: the point of their mean plane that is
/// nearest to the vertex.
void NonrigidStep::observe_planes(std::span<const SurfaceRow> rows, Field x) {
  std::vector<std::uint8_t> is_drawn(topology_.report.components);
  const auto component = [&](std::size_t v) { return at(topology_.component[v]); };
  std::vector<double> along(x.size());
  std::ranges::fill(planes_, Vector3<double>{});
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
    planes_[v] = is_seen ? (1 / length) * planes_[v] : Vector3<double>{};
    anchors_.observed[v] = is_seen ? x[v] + (along[v] / anchors_.weights[v]) * planes_[v] : x[v];
    if (!is_seen) anchors_.weights[v] = 0;
    anchors_.is_solved[v] = is_drawn[component(v)];
    anchors_.counts[v] = is_drawn[component(v)];
    anchors_.number += is_seen ? 1 : 0;
    anchors_.n_solved += is_drawn[component(v)];
  }
}

/// Fits the rest shape by the points.
void NonrigidStep::fit_modes(std::span<const SurfaceRow> rows, double mode_weights, Field x) {
  observe_planes(rows, x);
  for (double& weight : anchors_.weights) weight *= mode_weights;
  system_.factorize(anchors_);
  rest_.fit(x, shape_, anchors_, rounding_.mean_square(x), system_, rotations_);
}

void NonrigidStep::keep_rows(std::span<const SurfaceRow> rows, Field x) {
  if (!error_bars_.exist()) return;
  observe_planes(rows, x);
  if (anchors_.any_solved()) system_.factorize(anchors_);
}

void NonrigidStep::measure_errors(const Generations& generations, Field x, double unseen) {
  if (!error_bars_.exist()) return;
  if (!anchors_.any_solved()) {
    error_bars_.pass(generations, rotations_.clusters());
    return;
  }
  system_.apply(x, 1, kx_);
  anchors_.normals = planes_;
  error_bars_.update({x, kx_, turned_, rounding_.mean_square(x)}, anchors_, generations, system_,
                     rotations_.clusters());
  error_bars_.widen(generations, unseen);
  anchors_.normals = {};
}

void NonrigidStep::remember(Field completed) {
  rotations_.fit(completed);
  keep();
  find_shape(completed);
}

void NonrigidStep::find_shape(Field frame) {
  system_.apply(frame, 1, wanted_);
  rotations_.turn_back(wanted_, shape_);
}

void NonrigidStep::write_memory(Writer& writer) const {
  writer.write(std::span<const double>(remembered_));
  error_bars_.write_memory(writer);
}

void NonrigidStep::read_memory(Reader& reader, Field last) {
  reader.read_finite(std::span(remembered_));
  error_bars_.read_memory(reader);
  begin_frame();
  check_stored(rotations_.quaternions());
  find_shape(last);
}

}  // namespace dynmesh
