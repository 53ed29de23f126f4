#include "detail/detail.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <utility>

#include "support/geometry.hpp"
#include "support/stopwatch.hpp"

namespace dynmesh {

template <class Real>
Detail<Real>::Workspace::Workspace(std::size_t n_vertices, bool is_noisy, bool has_pose)
    : anchors(n_vertices, is_noisy),
      x(n_vertices),
      kx(n_vertices),
      shape(n_vertices),
      k_steps(3 * n_vertices),
      steps(has_pose ? 3 * n_vertices : 0),
      wanted(steps.size()),
      shapes(steps.size()) {}

template <class Real>
Detail<Real>::Detail(std::vector<Triangle> faces, const Topology& topology,
                     std::optional<double> noise, Workers& workers,
                     const DetailConstants& constants, TrainingFrames<Real> training, bool learns,
                     bool has_uncertainty)
    : faces_(std::move(faces)),
      topology_(topology),
      constants_(constants),
      system_(topology.cells, workers),
      rotations_(topology.cells, workers),
      local_blend_(topology.cells, constants_),
      memory_(topology.cells.size(), constants_),
      training_(std::move(training)),
      shape_fit_(topology.cells, workers, constants_.training, learns),
      learns_(learns),
      error_bars_(topology.cells, workers, constants_, has_uncertainty, noise.has_value()),
      noise_(noise),
      next_generations_(topology.cells.size()),
      workspace_(topology.cells.size(), noise.has_value(), learns || !training_.empty()),
      workers_(workers) {}

template <class Real>
void Detail<Real>::reset(Frame first_frame) {
  auto prepared = system_.template prepare<Real>(faces_, first_frame, constants_);
  const auto mean_edge = static_cast<double>(mean_edge_length(topology_.cells, first_frame));
  const Rounding rounding(prepared.k, mean_edge, std::numeric_limits<Real>::epsilon());
  const Field first = in_workspace(first_frame);
  auto prepared_rotations = rotations_.prepare(first);
  if (!training_.empty()) {
    const TrainingConstants& constants = constants_.training;
    const auto parts = divide_surface(topology_.cells, first, constants);
    const auto shapes = training_shapes<Real>(training_, prepared.k, topology_.cells, first,
                                              mean_edge, constants_.largest_stiff_angle, workers_);
    shape_fit_.reset(Modes(parts, shapes, training_.size(), constants,
                           scale_of<Real>(training_, rounding, mean_edge)));
  }
  if (learns_) {
    const auto parts = divide_surface(topology_.cells, first, constants_.training);
    const ModeScale scale = {mean_edge, rounding.mean_square<double>(first)};
    auto learned = std::make_unique<LearnedModes>(parts, workers_, constants_.training, scale);
    shape_fit_.reset(Modes(parts, mean_edge));
    learned_ = std::move(learned);
  }
  // Nothing below can throw.
  system_.reset(std::move(prepared));
  mean_edge_ = mean_edge;
  rounding_ = rounding;
  rotations_.reset(std::move(prepared_rotations), first, mean_edge_);
  system_.apply(first, 1, workspace_.kx);
  memory_.reset(workspace_.kx, mean_edge_);
  error_bars_.reset();
  lambda_ = constants_.first_lambda;
  report_ = {};
}

template <class Real>
Index Detail<Real>::estimate(Frame previous, std::span<Vector3<Real>> points,
                             std::span<const std::uint8_t> known, Generations& generations) {
  report_ = {};
  next_generations_.classify(topology_.cells, known);
  const Anchors& anchors = hold(in_workspace(previous), points, next_generations_);  // may throw
  std::swap(generations, next_generations_);
  workspace_.is_posed = false;
  workspace_.is_stiff.reset();
  if (!anchors.any_solved()) {
    if (error_bars_.exist()) error_bars_.pass(generations, rotations_);
    return 0;
  }

  // Step 1: find the smoothest motion.
  Positions positions = move_smoothly(workspace_.x, anchors);

  // Step 2: find the global b and c.
  Field shapes = turned_shapes(positions);
  const ResidualField unposed = find_directions(positions, shapes, anchors);
  // With modes, a fitted shape takes the place of m_first or m from here on.
  const ResidualField directions =
      shape_fit_.exists() ? pose_shapes(unposed, generations) : unposed;
  const ResidualSums sums = sum_products(directions, mean_edge_);
  const Blend blend = bounded(global_blend(sums, constants_));

  // Step 3: find the local b_i.
  const std::span<const double> b = local_blend_.find(directions, sums, blend);
  positions = take_directions(positions, directions, blend);

  // Step 4: fit rotations and solve again.
  Field shape;
  for (int round = 1; round < constants_.rounds; ++round) {
    shapes = turned_shapes(positions);
    shape = blended(shapes, b, blend.c);
    positions = take_shape(positions, shape, anchors);
  }

  if (noise_) weigh_anchors(positions, shape, anchors);
  for (const Index solved : system_.solved()) {
    const auto v = static_cast<std::size_t>(solved);
    const Vector3<double>& x = positions.x[v];
    points[v] = {saturated<Real>(x.x), saturated<Real>(x.y), saturated<Real>(x.z)};
  }
  if (error_bars_.exist()) {
    error_bars_.update({positions.x, positions.kx, shape, directions.rounding}, blend.c, anchors,
                       generations, system_, rotations_);
  }
  report_.blend = blend.b;
  return constants_.rounds;
}

template <class Real>
typename Detail<Real>::Field Detail<Real>::in_workspace(Frame frame) {
  std::ranges::transform(frame, workspace_.x.begin(), in_double<Real>);
  return workspace_.x;
}

/// Sets the anchors of the frame and factors N for them.
template <class Real>
const Anchors& Detail<Real>::hold(Field previous, std::span<const Vector3<Real>> points,
                                  const Generations& generations) {
  workspace_.anchors.template set_frame<Real>(previous, points, generations, lambda_);
  const Stopwatch stopwatch(report_.factor_seconds);
  if (workspace_.anchors.any_solved()) system_.factorize(workspace_.anchors);
  return workspace_.anchors;
}

/// The smoothest motion from the last frame X' that the anchors allow: min |K (X - X')|^2.
template <class Real>
typename Detail<Real>::Positions Detail<Real>::move_smoothly(Field previous,
                                                             const Anchors& anchors) {
  const Stopwatch stopwatch(report_.solve_seconds);
  std::vector<Vector3<double>>& moved = workspace_.shape;  // K times the motion of the anchors
  if (!anchors.are_noisy()) {
    for (std::size_t v = 0; v < previous.size(); ++v) {
      workspace_.k_steps[v] = anchors.observed[v] - previous[v];
    }
    system_.apply(workspace_.k_steps, 1, moved);
    std::ranges::copy(anchors.observed, workspace_.x.begin());
  } else {
    std::ranges::fill(moved, Vector3<double>{});
  }
  const Positions positions{workspace_.x, workspace_.kx};
  const Field step = system_.template solve<1>(
      [&](std::size_t v, std::size_t) { return -1.0 * moved[v]; }, positions.x, anchors);
  for (std::size_t v = 0; v < step.size(); ++v) positions.x[v] = positions.x[v] + step[v];
  system_.apply(positions.x, 1, positions.kx);
  return positions;
}

/// Fits Q to the positions, with the same averages in all fits of a frame.
template <class Real>
void Detail<Real>::fit_rotations(Field positions) {
  std::optional<bool>& is_stiff = workspace_.is_stiff;
  const bool is_first = !is_stiff.has_value();
  if (is_first || *is_stiff) {
    const double angle = rotations_.fit_widely(positions);
    if (is_first) is_stiff = angle <= constants_.largest_stiff_angle;
  }
  if (!*is_stiff) rotations_.fit_narrowly(positions);
}

/// Fits Q to the positions and returns Q m, Q (m_first - m) and Q u: (3 k,).
template <class Real>
typename Detail<Real>::Field Detail<Real>::turned_shapes(const Positions& positions) {
  const Stopwatch stopwatch(report_.rotation_seconds);
  fit_rotations(positions.x);
  return rotations_.turn(shapes_in_memory());
}

/// m, m_first - m and u; once the frame's pose is known, with the fitted rest shape as m_first.
template <class Real>
typename Detail<Real>::Field Detail<Real>::shapes_in_memory() const {
  return workspace_.is_posed ? Field(workspace_.shapes) : memory_.shapes();
}

/// Computes the steps towards Q m, those that a unit of b and of c add, and the residuals they
/// leave.
template <class Real>
ResidualField Detail<Real>::find_directions(const Positions& positions, Field shapes,
                                            const Anchors& anchors) {
  const Stopwatch stopwatch(report_.solve_seconds);
  const Field steps = system_.template solve<3>(
      [&](std::size_t v, std::size_t field) {
        return field == 0 ? shapes[3 * v] - positions.kx[v] : shapes[3 * v + field];
      },
      positions.x, anchors);
  system_.apply(steps, 3, workspace_.k_steps);
  return {anchors,
          positions.x,
          positions.kx,
          shapes,
          steps,
          workspace_.k_steps,
          rounding_.mean_square<double>(positions.x)};
}

/// Fits the rest shape by what the anchors say: p = m_first + k B a takes the place of m_first. If
/// the pose is a change, m + k B a takes the place of m.
template <class Real>
ResidualField Detail<Real>::pose_shapes(ResidualField directions, const Generations& generations) {
  const Stopwatch stopwatch(report_.solve_seconds);
  system_.keep_steps(workspace_.steps);  // the next solutions overwrite them
  std::ranges::copy(directions.wanted, workspace_.wanted.begin());
  directions.steps = workspace_.steps;
  directions.wanted = workspace_.wanted;
  const ShapeFit::Found pose = shape_fit_.find(directions, system_, rotations_, generations);
  report_.prior_weight = pose.prior_weight;
  report_.prior_share = pose.prior_share;
  blend_is_uncertain_ = pose.is_first && !shape_fit_.is_change();
  if (pose.prior_weight == 0) return directions;
  std::ranges::copy(memory_.shapes(), workspace_.shapes.begin());
  const auto add = [&](std::size_t row, std::size_t v, double k) {
    workspace_.steps[row] = workspace_.steps[row] + k * pose.steps[v];
    workspace_.k_steps[row] = workspace_.k_steps[row] + k * pose.k_steps[v];
    workspace_.wanted[row] = workspace_.wanted[row] + k * pose.wanted[v];
    workspace_.shapes[row] = workspace_.shapes[row] + k * shape_fit_.shape()[v];
  };
  for (std::size_t v = 0; v < directions.size(); ++v) {
    if (shape_fit_.is_change()) {
      add(3 * v, v, pose.prior_weight);
      add(3 * v + 1, v, -pose.prior_weight);
    } else {
      add(3 * v + 1, v, pose.prior_weight);
    }
  }
  workspace_.is_posed = true;
  return directions;
}

/// In the first frame, the fitted rest shape hardly differs from the last one, and b could be any
/// number.
template <class Real>
Blend Detail<Real>::bounded(Blend blend) const {
  if (workspace_.is_posed && blend_is_uncertain_) {
    blend.b = std::clamp(blend.b, constants_.least_blend, constants_.largest_blend);
  }
  return blend;
}

template <class Real>
typename Detail<Real>::Positions Detail<Real>::take_directions(Positions positions,
                                                               const ResidualField& directions,
                                                               const Blend& blend) {
  const Stopwatch stopwatch(report_.solve_seconds);
  const auto combined = [&](const Vector3<double>& from, Field triples, std::size_t v) {
    return from + triples[3 * v] + blend.b * triples[3 * v + 1] + blend.c * triples[3 * v + 2];
  };
  for (std::size_t v = 0; v < positions.x.size(); ++v) {
    positions.x[v] = combined(positions.x[v], directions.steps, v);
    positions.kx[v] = combined(positions.kx[v], directions.k_steps, v);
  }
  return positions;
}

/// Returns Q (m + b_i (m_first - m) + c u): (k,).
template <class Real>
typename Detail<Real>::Field Detail<Real>::blended(Field shapes, std::span<const double> b,
                                                   double c) {
  const Stopwatch stopwatch(report_.solve_seconds);
  for (std::size_t v = 0; v < b.size(); ++v) {
    workspace_.shape[v] = shapes[3 * v] + b[v] * shapes[3 * v + 1] + c * shapes[3 * v + 2];
  }
  return workspace_.shape;
}

/// Moves the positions to those whose detail is closest to the shape.
template <class Real>
typename Detail<Real>::Positions Detail<Real>::take_shape(Positions positions, Field shape,
                                                          const Anchors& anchors) {
  const Stopwatch stopwatch(report_.solve_seconds);
  const Field step = system_.template solve<1>(
      [&](std::size_t v, std::size_t) { return shape[v] - positions.kx[v]; }, positions.x, anchors);
  for (std::size_t v = 0; v < step.size(); ++v) positions.x[v] = positions.x[v] + step[v];
  system_.apply(positions.x, 1, positions.kx);
  return positions;
}

/// Computes lambda for the next frame from the error of the shape per coordinate, sigma_L^2 = (E +
/// lambda |q|^2) / (3 anchors), where E is the energy and q the displacement of the anchors from
/// their observed positions.
template <class Real>
void Detail<Real>::weigh_anchors(const Positions& positions, Field shape, const Anchors& anchors) {
  double energy = 0;
  for (std::size_t v = 0; v < shape.size(); ++v) {
    energy += anchors.counts[v] * squared_norm(positions.kx[v] - shape[v]);
    energy += anchors.weights[v] * squared_norm(positions.x[v] - anchors.observed[v]);
  }
  if (!std::isfinite(energy)) return;
  // The square of a small noise would be 0. Any noise that is small enough has the largest lambda.
  const double found = energy / (3 * static_cast<double>(anchors.number)) / *noise_ / *noise_;
  lambda_ = (lambda_ + std::clamp(found, constants_.least_lambda, constants_.largest_lambda)) / 2;
}

/// Returns Q^T K X of a completed frame to which Q has been fitted.
template <class Real>
typename Detail<Real>::Field Detail<Real>::detail_turned_back(Field completed) {
  system_.apply(completed, 1, workspace_.kx);
  return rotations_.turn_back(workspace_.kx);
}

template <class Real>
void Detail<Real>::remember(Frame completed) {
  const Stopwatch stopwatch(report_.rotation_seconds);
  const Field x = in_workspace(completed);
  fit_rotations(x);
  memory_.learn(detail_turned_back(x));
  if (learned_) learned_->advance(memory_.shapes(), workspace_.anchors.number > 0, shape_fit_);
}

template <class Real>
typename Detail<Real>::Memory Detail<Real>::memory() const {
  Memory memory;
  memory.rows.reserve(memory_rows());
  for (std::size_t v = 0; v < topology_.cells.size(); ++v) {
    const Quaternion& q = rotations_.quaternions()[v];
    const Vector3<double>& u = memory_.change(v);
    memory.rows.push_back({q.w, q.x, q.y, q.z, u.x, u.y, u.z});
  }
  memory.anchor_weight = lambda_;
  if (shape_fit_size() > 0) {
    memory.pose.reserve(shape_fit_size());
    memory.pose = shape_fit_.memory();
  }
  if (learned_) {
    learned_->append_memory(memory.pose);
    memory.shapes.assign(learned_->rows().begin(), learned_->rows().end());
  }
  memory.errors = error_bars_.memory();
  return memory;
}

template <class Real>
bool Detail<Real>::accepts(const Memory& memory) const {
  constexpr double rounding = 1e-6;
  const auto is_sound = [](const auto& row) {
    const double norm = row[0] * row[0] + row[1] * row[1] + row[2] * row[2] + row[3] * row[3];
    return std::abs(norm - 1) <= rounding && is_in_range(Vector3<double>{row[4], row[5], row[6]});
  };
  return memory.rows.size() == memory_rows() && std::ranges::all_of(memory.rows, is_sound) &&
         memory.anchor_weight >= constants_.least_lambda &&
         memory.anchor_weight <= constants_.largest_lambda &&
         memory.pose.size() == shape_fit_size() && memory.shapes.size() == shape_rows() &&
         (shape_fit_size() == 0 || accepts_shape_fit(memory)) && error_bars_.accepts(memory.errors);
}

template <class Real>
bool Detail<Real>::accepts_shape_fit(const Memory& memory) const {
  const std::span<const double> values = memory.pose;
  const std::size_t of_pose = shape_fit_.memory_size();
  return shape_fit_.accepts(values.first(of_pose)) &&
         (!learned_ ||
          LearnedModes::accepts(values.subspan(of_pose), memory.shapes, constants_.training));
}

template <class Real>
void Detail<Real>::recall(const Memory& memory, Frame completed) {
  std::ranges::transform(memory.rows, rotations_.quaternions().begin(), [](const auto& row) {
    return Quaternion{row[0], row[1], row[2], row[3]};
  });
  lambda_ = memory.anchor_weight;
  const Field detail = detail_turned_back(in_workspace(completed));
  std::ranges::transform(memory.rows, workspace_.shape.begin(), [](const auto& row) {
    return Vector3<double>{row[4], row[5], row[6]};
  });
  memory_.recall(detail, workspace_.shape);
  error_bars_.recall(memory.errors);
  if (shape_fit_size() == 0) return;
  const std::span<const double> values = memory.pose;
  const std::size_t of_pose = shape_fit_.memory_size();
  if (learned_) learned_->recall(values.subspan(of_pose), memory.shapes, shape_fit_);
  shape_fit_.recall(values.first(of_pose));
}

template class Detail<float>;
template class Detail<double>;

}  // namespace dynmesh
