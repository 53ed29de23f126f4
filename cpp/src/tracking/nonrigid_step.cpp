#include "tracking/nonrigid_step.hpp"

#include <algorithm>
#include <array>
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
      is_cloth_(topology.cells.size()),
      shape_(topology.cells.size()),
      last_rotations_(topology.cells.size()),
      anchors_(topology.cells.size(), true),
      wanted_(topology.cells.size()),
      turned_(topology.cells.size()),
      kx_(topology.cells.size()),
      planes_(topology.cells.size()),
      forces_(topology.cells.size()),
      held_(topology.cells.size()),
      found_in_(topology.report.components),
      factored_weights_(topology.cells.size()) {
  system_.take_planes(constants.steps);
}

void NonrigidStep::reset(std::span<const Triangle> faces, Field first_frame, double mean_edge,
                         std::span<const std::uint8_t> is_cloth) {
  const bool any_cloth = std::ranges::count(is_cloth, 1) > 0;
  std::vector<double> stiffness;
  if (any_cloth) {
    for (const auto is : is_cloth) stiffness.push_back(is != 0 ? constants_.membrane : 0);
  }
  auto prepared = system_.prepare(faces, first_frame, detail_constants_, std::move(stiffness));
  std::unique_ptr<Membrane> membrane;
  if (any_cloth) {
    membrane = std::make_unique<Membrane>(faces, first_frame, mean_edge, is_cloth,
                                          constants_.membrane, workers_);
    outward_.resize(first_frame.size());
  }
  auto prepared_rotations = rotations_.prepare(first_frame);
  const Rounding rounding(prepared.k, mean_edge, epsilon_);
  rest_.reset(rest_.learn(prepared.k, first_frame, mean_edge, rounding));
  // Nothing below can throw.
  system_.reset(std::move(prepared));
  membrane_ = std::move(membrane);
  std::ranges::copy(is_cloth, is_cloth_.begin());
  rounding_ = rounding;
  rotations_.reset(std::move(prepared_rotations), first_frame, mean_edge);
  system_.take_planes(any_cloth ? constants_.cloth_steps : constants_.steps);
  system_.apply(first_frame, 1, shape_);
  rest_.set_first(shape_);
  error_bars_.reset();
}

void NonrigidStep::begin_frame() {
  std::ranges::copy(rotations_.quaternions(), last_rotations_.begin());
  rest_.begin_frame();
  is_factored_ = false;
  last_step_.clear();
}

void NonrigidStep::undo_frame() {
  std::ranges::copy(last_rotations_, rotations_.quaternions().begin());
  rest_.undo_frame();
}

bool NonrigidStep::take(const Measured& measured, bool fits_modes, std::span<Vector3<double>> x) {
  const auto found = measured.found;
  hold(measured.landmarks);
  if (!choose_components(measured)) return false;
  rotations_.fit(x);
  if (fits_modes && rest_.is_trained()) fit_modes(found, x);
  for (std::size_t v = 0; v < x.size(); ++v) {
    const double pull = is_cloth_[v] != 0 ? constants_.cloth_pull : constants_.pull;
    wanted_[v] = shape_[v] + pull * (rest_.shape()[v] - shape_[v]);
  }
  rotations_.turn(wanted_, turned_);
  system_.apply(x, 1, kx_);
  for (std::size_t v = 0; v < x.size(); ++v) anchors_.weights[v] = found[v].weight;
  std::ranges::transform(found, planes_.begin(), &Correspondence::normal);
  anchors_.normals = planes_;
  if (membrane_) pull_cloth(measured, x);
  if (!measured.landmarks.empty()) {
    if (!membrane_) std::ranges::fill(forces_, Vector3<double>{});
    for (const Landmark& l : measured.landmarks) {
      forces_[l.vertex] = forces_[l.vertex] + l.weight * (l.target - x[l.vertex]);
    }
    anchors_.forces = forces_;
    anchors_.held = held_;
  }
  anchors_.guess = last_step_;
  const Field steps = system_.solve<1, 1>(
      [&](std::size_t v, std::size_t) { return turned_[v] - kx_[v]; },
      [&](std::size_t v, std::size_t) { return found[v].point - x[v]; }, anchors_);
  anchors_.normals = anchors_.outward = anchors_.forces = anchors_.guess = {};
  anchors_.held = {};
  last_step_.assign(steps.begin(), steps.end());
  for (std::size_t v = 0; v < x.size(); ++v) x[v] = x[v] + steps[v];
  return true;
}

void NonrigidStep::hold(std::span<const Landmark> landmarks) {
  std::ranges::fill(held_, 0.0);
  for (const Landmark& landmark : landmarks) held_[landmark.vertex] += landmark.weight;
}

/// Draws the boundaries of cloth to where the measured surface ends, and its triangles into shape.
void NonrigidStep::pull_cloth(const Measured& measured, Field x) {
  const double root = std::sqrt(constants_.reach_weight * measured.cloth_weight);
  for (std::size_t v = 0; v < x.size(); ++v) {
    const Reach& reach = measured.reaches[v];
    outward_[v] = root * reach.outward;
    forces_[v] = root * dot(reach.outward, reach.end - x[v]) * outward_[v];
  }
  membrane_->add_forces(x, forces_);
  anchors_.outward = outward_;
  anchors_.forces = forces_;
}

/// Chooses the components with enough correspondences, of which those that are far away count less,
/// and factors their system if they are others than in the last step.
bool NonrigidStep::choose_components(const Measured& measured) {
  const auto found = measured.found;
  const auto component = [&](std::size_t v) {
    return static_cast<std::size_t>(topology_.component[v]);
  };
  std::ranges::fill(found_in_, 0.0);
  for (const Landmark& landmark : measured.landmarks) {
    if (landmark.weight > 0) found_in_[component(landmark.vertex)] += constants_.fewest;
  }
  for (std::size_t v = 0; v < found.size(); ++v)
    found_in_[component(v)] +=
        found[v].weight / (is_cloth_[v] != 0 ? measured.cloth_weight : measured.weight);
  anchors_.n_solved = 0;
  bool is_the_same = is_factored_;
  for (std::size_t v = 0; v < found.size(); ++v) {
    const bool is_solved = found_in_[component(v)] >= constants_.fewest;
    is_the_same = is_the_same && (anchors_.is_solved[v] != 0) == is_solved;
    anchors_.is_solved[v] = is_solved ? 1 : 0;
    if (!is_solved) found[v].weight = 0;
    anchors_.n_solved += is_solved ? 1 : 0;
  }
  if (anchors_.n_solved == 0) return false;
  if (!is_the_same) {
    for (std::size_t v = 0; v < found.size(); ++v) {
      anchors_.weights[v] = found[v].weight + held_[v];
    }
    std::ranges::copy(anchors_.weights, factored_weights_.begin());
    system_.factorize(anchors_);
    is_factored_ = true;
  }
  return true;
}

/// The correspondences as anchors: each is the point of its plane that is nearest to the vertex.
void NonrigidStep::observe_planes(std::span<const Correspondence> found, Field x) {
  anchors_.number = 0;
  for (std::size_t v = 0; v < x.size(); ++v) {
    const Correspondence& c = found[v];
    anchors_.counts[v] = anchors_.is_solved[v];
    anchors_.observed[v] = x[v] + dot(c.normal, c.point - x[v]) * c.normal;
    anchors_.weights[v] = c.weight;
    anchors_.number += c.weight > 0 ? 1 : 0;
  }
}

/// Fits the rest shape by the correspondences. The factor is that of the present weights meanwhile,
/// and then again the preconditioner of the frame, so that a training sequence that is not used
/// changes nothing.
void NonrigidStep::fit_modes(std::span<const Correspondence> found, Field x) {
  observe_planes(found, x);
  system_.factorize(anchors_);
  rest_.fit({x, shape_, anchors_, rounding_.mean_square(x)}, system_, rotations_);
  std::ranges::copy(factored_weights_, anchors_.weights.begin());
  system_.factorize(anchors_);
}

void NonrigidStep::keep_planes(std::span<const Correspondence> found, Field x) {
  if (!error_bars_.exist() || !anchors_.any_solved()) return;
  observe_planes(found, x);
  system_.factorize(anchors_);
  std::ranges::transform(found, planes_.begin(), &Correspondence::normal);
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
