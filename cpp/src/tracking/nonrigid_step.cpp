#include "tracking/nonrigid_step.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "support/geometry.hpp"

namespace dynmesh {
namespace {

Vector3<double> rotated(const Quaternion& q, const Vector3<double>& x) {
  const Vector3<double> axis = {q.x, q.y, q.z};
  const auto twice = 2.0 * cross(axis, x);
  return x + q.w * twice + cross(axis, twice);
}

DetailConstants constants_for(const TrackingConstants& tracking) {
  DetailConstants constants;
  constants.training.largest_kept = tracking.largest_kept;
  return constants;
}

}  // namespace

NonrigidStep::NonrigidStep(const Topology& topology, Workers& workers,
                           const TrackingConstants& constants, TrainingFrames training,
                           bool has_uncertainty, double epsilon)
    : topology_(topology),
      workers_(workers),
      constants_(constants),
      detail_constants_(constants_for(constants)),
      system_(topology.cells, workers),
      rotations_(topology.cells, workers),
      epsilon_(epsilon),
      rest_(topology.cells, workers, detail_constants_, std::move(training)),
      error_bars_(topology.cells, workers, detail_constants_, has_uncertainty, true),
      pulls_(topology.cells.size()),
      shape_(topology.cells.size()),
      last_rotations_(topology.cells.size()),
      anchors_(topology.cells.size(), true),
      wanted_(topology.cells.size()),
      turned_(topology.cells.size()),
      kx_(topology.cells.size()),
      planes_(topology.cells.size()),
      forces_(topology.cells.size()),
      held_(topology.cells.size()),
      factored_weights_(topology.cells.size()) {
  system_.take_planes(constants.steps, constants.settled);
}

void NonrigidStep::reset(std::span<const Triangle> faces, Field first_frame, double mean_edge,
                         std::span<const std::uint8_t> is_cloth) {
  std::vector<double> stiffness(first_frame.size(), constants_.membrane);
  for (std::size_t v = 0; v < stiffness.size(); ++v) {
    if (is_cloth[v] != 0) stiffness[v] = constants_.cloth_membrane;
  }
  auto membrane = std::make_unique<Membrane>(faces, first_frame, mean_edge, stiffness, workers_);
  auto ties = find_ties(topology_, first_frame, mean_edge, constants_);
  auto prepared = system_.prepare(faces, first_frame, detail_constants_, std::move(stiffness));
  auto prepared_rotations = rotations_.prepare(first_frame);
  const Rounding rounding(prepared.k, mean_edge, epsilon_);
  rest_.reset(rest_.learn(prepared.k, first_frame, mean_edge, rounding));
  // Nothing below can throw.
  system_.reset(std::move(prepared));
  membrane_ = std::move(membrane);
  ties_ = std::move(ties);
  tied_.clear();
  for (const Tie& tie : ties_) tied_.push_back(first_frame[tie.i] - first_frame[tie.j]);
  for (std::size_t v = 0; v < pulls_.size(); ++v) {
    pulls_[v] = is_cloth[v] != 0 ? constants_.cloth_pull : constants_.pull;
  }
  rounding_ = rounding;
  rotations_.reset(std::move(prepared_rotations), first_frame, mean_edge);
  system_.apply(first_frame, 1, shape_);
  rest_.set_first(shape_);
  error_bars_.reset();
}

void NonrigidStep::begin_frame() {
  std::ranges::copy(rotations_.quaternions(), last_rotations_.begin());
  rest_.begin_frame();
}

void NonrigidStep::undo_frame() {
  std::ranges::copy(last_rotations_, rotations_.quaternions().begin());
  rest_.undo_frame();
}

bool NonrigidStep::take(SurfaceRows& rows, std::span<const Landmark> landmarks, double mode_weights,
                        std::span<Vector3<double>> x) {
  if (rows.empty() && landmarks.empty()) return false;
  hold(landmarks);
  rotations_.fit(x);
  if (mode_weights > 0 && rest_.is_trained()) fit_modes(rows, mode_weights, x);
  for (std::size_t v = 0; v < x.size(); ++v) {
    wanted_[v] = shape_[v] + pulls_[v] * (rest_.shape()[v] - shape_[v]);
  }
  rotations_.turn(wanted_, turned_);
  system_.apply(x, 1, kx_);
  for (std::size_t v = 0; v < x.size(); ++v) kx_[v] = turned_[v] - kx_[v];
  find_forces(rows, landmarks, x);
  anchors_.rows = &rows;
  anchors_.forces = forces_;
  anchors_.held = held_;
  anchors_.ties = ties_;
  const Field steps = system_.descend_to_rows(kx_, anchors_);
  anchors_.rows = nullptr;
  for (std::size_t v = 0; v < x.size(); ++v) x[v] = x[v] + steps[v];
  return true;
}

void NonrigidStep::hold(std::span<const Landmark> landmarks) {
  std::ranges::fill(held_, constants_.hold);
  for (const Landmark& landmark : landmarks) held_[landmark.vertex] += landmark.weight;
}

/// Half of the negative gradient of all but the shape.
void NonrigidStep::find_forces(SurfaceRows& rows, std::span<const Landmark> landmarks, Field x) {
  rows.compare(x, workers_);
  workers_.for_each_in_chunks(x.size(), [&](std::size_t v) { forces_[v] = rows.at(v); });
  membrane_->add_forces(x, forces_);
  for (std::size_t t = 0; t < ties_.size(); ++t) {
    const Tie& tie = ties_[t];
    const auto turned = 0.5 * (rotated(rotations_.quaternions()[tie.i], tied_[t]) +
                               rotated(rotations_.quaternions()[tie.j], tied_[t]));
    const auto force = tie.weight * (turned - (x[tie.i] - x[tie.j]));
    forces_[tie.i] = forces_[tie.i] + force;
    forces_[tie.j] = forces_[tie.j] - force;
  }
  for (const Landmark& l : landmarks) {
    forces_[l.vertex] = forces_[l.vertex] + l.weight * (l.target - x[l.vertex]);
  }
}

void NonrigidStep::factorize(const SurfaceRows& rows, std::span<const Landmark> landmarks) {
  hold(landmarks);
  for (std::size_t v = 0; v < held_.size(); ++v) {
    anchors_.weights[v] = held_[v] + constants_.preconditioned * rows.weight_at(v);
  }
  for (const Tie& tie : ties_) {
    anchors_.weights[tie.i] += tie.weight;
    anchors_.weights[tie.j] += tie.weight;
  }
  std::ranges::fill(anchors_.is_solved, std::uint8_t{1});
  anchors_.n_solved = anchors_.is_solved.size();
  std::ranges::copy(anchors_.weights, factored_weights_.begin());
  system_.factorize(anchors_);
}

/// The rows as anchors, one for each vertex that they touch: the point of their mean plane that is
/// nearest to the vertex.
void NonrigidStep::observe_planes(const SurfaceRows& rows, Field x) {
  std::vector<std::uint8_t> is_drawn(topology_.report.components);
  const auto component = [&](std::size_t v) {
    return static_cast<std::size_t>(topology_.component[v]);
  };
  for (const SurfaceRow& row : rows.rows) is_drawn[component(row.corners[0])] = 1;
  anchors_.number = 0;
  anchors_.n_solved = 0;
  for (std::size_t v = 0; v < x.size(); ++v) {
    double weight = 0;
    double along = 0;
    Vector3<double> normal;
    rows.for_each_at(v, [&](const SurfaceRow& row, double share) {
      weight += row.weight * share;
      normal = normal + row.weight * share * row.normal;
      along += row.weight * share * dot(row.normal, row.point - row.on(x));
    });
    const double length = std::sqrt(squared_norm(normal));
    const bool is_seen = weight > 0 && length > 0;
    planes_[v] = is_seen ? (1 / length) * normal : Vector3<double>{};
    anchors_.weights[v] = is_seen ? weight : 0;
    anchors_.observed[v] = is_seen ? x[v] + (along / weight) * planes_[v] : x[v];
    anchors_.is_solved[v] = is_drawn[component(v)];
    anchors_.counts[v] = is_drawn[component(v)];
    anchors_.number += is_seen ? 1 : 0;
    anchors_.n_solved += is_drawn[component(v)];
  }
}

/// Fits the rest shape by the points. The factor is that of the present weights meanwhile, and then
/// again the preconditioner of the frame, so that a training sequence that is not used changes
/// nothing.
void NonrigidStep::fit_modes(const SurfaceRows& rows, double mode_weights, Field x) {
  observe_planes(rows, x);
  for (double& weight : anchors_.weights) weight *= mode_weights;
  system_.factorize(anchors_);
  rest_.fit({x, shape_, anchors_, rounding_.mean_square(x)}, system_, rotations_);
  std::ranges::copy(factored_weights_, anchors_.weights.begin());
  std::ranges::fill(anchors_.is_solved, std::uint8_t{1});
  system_.factorize(anchors_);
}

void NonrigidStep::keep_rows(const SurfaceRows& rows, Field x) {
  if (!error_bars_.exist()) return;
  observe_planes(rows, x);
  if (anchors_.any_solved()) system_.factorize(anchors_);
}

void NonrigidStep::measure_errors(const Generations& generations, Field x) {
  if (!error_bars_.exist()) return;
  if (!anchors_.any_solved()) {
    error_bars_.pass(generations, rotations_.clusters());
    return;
  }
  system_.apply(x, 1, kx_);
  anchors_.normals = planes_;
  error_bars_.update({x, kx_, turned_, rounding_.mean_square(x)}, anchors_, generations, system_,
                     rotations_.clusters());
  anchors_.normals = {};
}

void NonrigidStep::remember(Field completed) {
  rotations_.fit(completed);
  system_.apply(completed, 1, wanted_);
  rotations_.turn_back(wanted_, shape_);
}

std::size_t NonrigidStep::memory_size() const {
  return (4 * shape_.size() + 2 + rest_.fit_size()) * sizeof(double) + error_bars_.memory_size();
}

void NonrigidStep::write_memory(Writer& writer) const {
  for (const Quaternion& q : rotations_.quaternions()) {
    for (const double number : {q.w, q.x, q.y, q.z}) writer.write(number);
  }
  const RestShape::Memory rest = rest_.memory();
  writer.write(rest.prior_weight);
  writer.write(rest.prior_share);
  writer.write(std::span<const double>(rest.fit));
  error_bars_.write_memory(writer);
}

NonrigidStep::Memory NonrigidStep::read_memory(Reader& reader) const {
  Memory memory;
  memory.rotations.resize(shape_.size());
  constexpr double rounding = 1e-6;
  for (std::size_t v = 0; v < shape_.size(); ++v) {
    std::array<double, 4> q{};
    reader.read(std::span<double>(q));
    const double norm = q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3];
    if (!(std::abs(norm - 1) <= rounding)) refuse_state("holds a rotation that is none");
    memory.rotations[v] = {q[0], q[1], q[2], q[3]};
  }
  memory.rest.prior_weight = reader.read<double>();
  memory.rest.prior_share = reader.read<double>();
  memory.rest.fit.resize(rest_.fit_size());
  reader.read(std::span<double>(memory.rest.fit));
  if (!rest_.accepts(memory.rest)) refuse_state("does not contain a valid rest shape");
  memory.errors = reader;
  ErrorBars(error_bars_).read_memory(reader);  // or it throws
  return memory;
}

void NonrigidStep::recall(Memory memory, Field last) {
  std::ranges::copy(memory.rotations, rotations_.quaternions().begin());
  system_.apply(last, 1, wanted_);
  rotations_.turn_back(wanted_, shape_);
  rest_.recall(memory.rest);
  error_bars_.read_memory(memory.errors);
}

}  // namespace dynmesh
