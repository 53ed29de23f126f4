#include "detail/detail.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <utility>

#include "support/geometry.hpp"

namespace dynmesh {
namespace {

/// Adds the duration of its scope to `seconds`.
class Stopwatch {
 public:
  explicit Stopwatch(double& seconds) : seconds_(seconds) {}
  Stopwatch(const Stopwatch&) = delete;
  Stopwatch& operator=(const Stopwatch&) = delete;
  ~Stopwatch() { seconds_ += std::chrono::duration<double>(Clock::now() - start_).count(); }

 private:
  using Clock = std::chrono::steady_clock;

  double& seconds_;
  Clock::time_point start_ = Clock::now();
};

}  // namespace

Detail::Workspace::Workspace(std::size_t n_vertices, bool is_noisy, bool has_modes)
    : anchors(n_vertices, is_noisy),
      x(n_vertices),
      kx(n_vertices),
      shape(n_vertices),
      turned(n_vertices),
      k_steps(n_vertices),
      steps(has_modes ? n_vertices : 0),
      shapes(steps.size()) {}

Detail::Detail(std::span<const Triangle> faces, const Topology& topology,
               std::optional<double> noise, Workers& workers, const DetailConstants& constants,
               const TrainingFrames& training, bool learns, bool has_uncertainty, double epsilon)
    : faces_(faces),
      topology_(topology),
      constants_(constants),
      system_(topology.cells, workers),
      rotations_(topology.cells, workers),
      local_blend_(topology.cells, workers, constants_),
      memory_(topology.cells.size(), constants_),
      training_(training),
      rest_fit_(ShapeFit::Of::rest, topology.cells, workers, constants_.training),
      learns_(learns),
      error_bars_(topology.cells, workers, constants_, has_uncertainty, noise.has_value()),
      first_order_(topology, workers, constants_.first_order, noise.has_value()),
      noise_(noise),
      next_generations_(topology.cells.size()),
      epsilon_(epsilon),
      workspace_(topology.cells.size(), noise.has_value(), learns || !training_.empty()),
      workers_(workers) {}

void Detail::reset(Frame first_frame) {
  auto prepared = system_.prepare(faces_, first_frame, constants_);
  const Field first = in_workspace(first_frame);
  mean_edge_ = mean_edge_length(topology_.cells, first_frame);
  rounding_ = Rounding(prepared.k, mean_edge_, epsilon_);
  if (!training_.empty()) {
    const auto parts = divide_surface(topology_.cells, first, constants_.training);
    rest_fit_.reset(training_modes(training_, parts, prepared.k, topology_.cells, first, mean_edge_,
                                   rounding_, constants_, workers_));
  }
  if (learns_) {
    const auto parts = divide_surface(topology_.cells, first, constants_.training);
    const ModeScale scale = {mean_edge_, rounding_.mean_square(first)};
    learned_ = std::make_unique<LearnedModes>(parts, topology_.cells, workers_, constants_.training,
                                              scale);
  }
  first_order_.reset(prepared.k, rounding_);
  system_.reset(std::move(prepared));
  rotations_.reset(rotations_.prepare(first), first, mean_edge_);
  system_.apply(first, 1, workspace_.kx);
  memory_.reset(workspace_.kx, mean_edge_);
  error_bars_.reset();
  lambda_ = constants_.first_lambda;
}

Index Detail::estimate(Frame previous, std::span<Vector3<double>> points,
                       std::span<const std::uint8_t> known, Generations& generations) {
  report_ = {};
  next_generations_.classify(topology_.cells, known);
  const Anchors& anchors = hold(in_workspace(previous), points, next_generations_);  // may throw
  std::swap(generations, next_generations_);
  first_order_.shares().count_frame();
  if (!anchors.any_solved()) {
    if (error_bars_.exist()) error_bars_.pass(generations, rotations_.clusters());
    return 0;
  }

  // Step 1: find the smoothest motion.
  Positions positions = move_smoothly(workspace_.x, anchors);
  fit_rotations(positions.x);

  // Step 2: find the global b and c. With modes, a fitted shape takes the place of m_first or m.
  const auto [directions, shapes, found] =
      fit_modes(find_directions(positions, turn(memory_.shapes()), anchors), generations);
  const ResidualSums sums = sum_products(directions, mean_edge_);
  Blend blend = global_blend(sums, constants_);
  // The rest shape that is fitted first hardly differs from the last one, and b could be anything.
  if (found.is_first) blend.b = bounded_blend(blend.b, constants_);

  // Step 3: find the local b_i.
  const std::span<const double> b = local_blend_.find(directions, sums, blend);
  positions = take_directions(positions, directions, blend);

  // Step 4: fit rotations and solve again.
  Field shape;
  for (int round = 1; round < constants_.rounds; ++round) {
    fit_rotations(positions.x);
    shape = blended(turn(shapes), b, blend.c);
    positions = take_shape(positions, shape, anchors);
  }

  if (noise_) weigh_anchors(positions, shape, anchors);
  if (error_bars_.exist()) {
    error_bars_.update({positions.x, positions.kx, shape, directions.rounding}, anchors,
                       generations, system_, rotations_.clusters());
  }

  // Step 5: move the satellites by a share of the first-order step.
  report_.first_order_share = take_first_order(previous, positions, shape, anchors, generations);
  for (std::size_t v = 0; v < points.size(); ++v) {
    if (anchors.is_solved[v] != 0) points[v] = positions.x[v];
  }
  report_.blend = blend.b;
  return constants_.rounds;
}

Detail::Field Detail::in_workspace(Frame frame) {
  std::ranges::copy(frame, workspace_.x.begin());
  return workspace_.x;
}

/// Sets the anchors of the frame and factors N for them.
const Anchors& Detail::hold(Field previous, std::span<const Vector3<double>> points,
                            const Generations& generations) {
  workspace_.anchors.set_frame(previous, points, generations, lambda_);
  const Stopwatch stopwatch(report_.factor_seconds);
  if (workspace_.anchors.any_solved()) system_.factorize(workspace_.anchors);
  return workspace_.anchors;
}

/// The smoothest motion from the last frame X' that the anchors allow: min |K (X - X')|^2.
Detail::Positions Detail::move_smoothly(Field previous, const Anchors& anchors) {
  const Stopwatch stopwatch(report_.solve_seconds);
  std::vector<Vector3<double>>& moved = workspace_.shape;  // K times the motion of the anchors
  if (!anchors.are_noisy()) {
    workers_.for_each_in_chunks(previous.size(), [&](std::size_t v) {
      workspace_.kx[v] = anchors.observed[v] - previous[v];
    });
    system_.apply(workspace_.kx, 1, moved);
    std::ranges::copy(anchors.observed, workspace_.x.begin());
  } else {
    std::ranges::fill(moved, Vector3<double>{});
  }
  const Positions positions{workspace_.x, workspace_.kx};
  const Field step = system_.solve<1>([&](std::size_t v, std::size_t) { return -1.0 * moved[v]; },
                                      positions.x, anchors);
  return take_step(positions, step);
}

void Detail::fit_rotations(Field positions) {
  const Stopwatch stopwatch(report_.rotation_seconds);
  rotations_.fit(positions);
}

/// Q m, Q (m_first - m) and Q u.
std::span<const ShapeTerms> Detail::turn(std::span<const ShapeTerms> shapes) {
  const Stopwatch stopwatch(report_.rotation_seconds);
  rotations_.turn(shapes, workspace_.turned);
  return workspace_.turned;
}

/// Computes the steps towards Q m, those that a unit of b and of c add, and the residuals they
/// leave.
ResidualField Detail::find_directions(const Positions& positions,
                                      std::span<const ShapeTerms> turned, const Anchors& anchors) {
  const Stopwatch stopwatch(report_.solve_seconds);
  const auto steps = system_.solve_terms(turned, positions.x, positions.kx, anchors);
  system_.apply(steps, workspace_.k_steps);
  return {anchors,
          positions.x,
          positions.kx,
          turned,
          steps,
          workspace_.k_steps,
          rounding_.mean_square(positions.x)};
}

/// Fits the modes, if there are any, by what the anchors say.
Detail::Fitted Detail::fit_modes(const ResidualField& directions, const Generations& generations) {
  if (rest_fit_.exists()) return add_modes(rest_fit_, directions, generations);
  if (learned_ && learned_->fit().exists()) {
    return add_modes(learned_->fit(), directions, generations);
  }
  return {directions, memory_.shapes()};
}

/// Adds what the fit finds to the shapes, and to the directions, which are in the workspace.
Detail::Fitted Detail::add_modes(ShapeFit& fit, ResidualField directions,
                                 const Generations& generations) {
  const Stopwatch stopwatch(report_.solve_seconds);
  system_.keep_steps(workspace_.steps);  // the next solutions overwrite them
  directions.steps = workspace_.steps;
  const FittedModes found = fit.find(directions, system_, rotations_, generations);
  const double k = found.prior_weight;
  report_.prior_weight = k;
  report_.prior_share = found.prior_share;
  if (k == 0) return {directions, memory_.shapes()};
  std::ranges::copy(memory_.shapes(), workspace_.shapes.begin());
  const AddedShape& added = fit.added();
  for (std::size_t v = 0; v < directions.size(); ++v) {
    fit.add(k * added.shape[v], workspace_.shapes[v]);
    fit.add(k * added.wanted[v], workspace_.turned[v]);
    fit.add(k * added.steps[v], workspace_.steps[v]);
    fit.add(k * added.k_steps[v], workspace_.k_steps[v]);
  }
  return {directions, workspace_.shapes, found};
}

Detail::Positions Detail::take_directions(Positions positions, const ResidualField& directions,
                                          const Blend& blend) {
  const Stopwatch stopwatch(report_.solve_seconds);
  const auto step = [&](Vector3<double>& from, const ShapeTerms& by) {
    from = from + by.last + blend.b * by.to_rest + blend.c * by.change;
  };
  workers_.for_each_in_chunks(positions.x.size(), [&](std::size_t v) {
    step(positions.x[v], directions.steps[v]);
    step(positions.kx[v], directions.k_steps[v]);
  });
  return positions;
}

Detail::Positions Detail::take_step(Positions positions, Field step) {
  workers_.for_each_in_chunks(step.size(),
                              [&](std::size_t v) { positions.x[v] = positions.x[v] + step[v]; });
  system_.apply(positions.x, 1, positions.kx);
  return positions;
}

/// Returns Q (m + b_i (m_first - m) + c u): (k,).
Detail::Field Detail::blended(std::span<const ShapeTerms> turned, std::span<const double> b,
                              double c) {
  const Stopwatch stopwatch(report_.solve_seconds);
  workers_.for_each_in_chunks(b.size(), [&](std::size_t v) {
    workspace_.shape[v] = turned[v].last + b[v] * turned[v].to_rest + c * turned[v].change;
  });
  return workspace_.shape;
}

/// Moves the positions to those whose detail is closest to the shape.
Detail::Positions Detail::take_shape(Positions positions, Field shape, const Anchors& anchors) {
  const Stopwatch stopwatch(report_.solve_seconds);
  const Field step = system_.solve<1>(
      [&](std::size_t v, std::size_t) { return shape[v] - positions.kx[v]; }, positions.x, anchors);
  return take_step(positions, step);
}

/// Returns the mean share of the satellites.
double Detail::take_first_order(Field previous, const Positions& positions, Field shape,
                                const Anchors& anchors, const Generations& generations) {
  const Stopwatch stopwatch(report_.solve_seconds);
  return first_order_.improve({previous, positions.x, positions.kx, shape}, anchors, generations,
                              system_);
}

/// Computes lambda for the next frame from the error of the shape per coordinate, sigma_L^2 = (E +
/// lambda |q|^2) / (3 anchors), where E is the energy and q the displacement of the anchors from
/// their observed positions.
void Detail::weigh_anchors(const Positions& positions, Field shape, const Anchors& anchors) {
  double energy = 0;
  for (std::size_t v = 0; v < shape.size(); ++v) {
    energy += anchors.counts[v] * squared_norm(positions.kx[v] - shape[v]);
    energy += anchors.weights[v] * squared_norm(positions.x[v] - anchors.observed[v]);
  }
  if (!std::isfinite(energy)) return;
  // The square of a small noise would be 0. Any noise that is small enough has the largest lambda.
  const double found = energy / (3 * static_cast<double>(anchors.number)) / *noise_ / *noise_;
  const double range = constants_.range_of_lambda;
  lambda_ = (lambda_ +
             std::clamp(found, constants_.first_lambda / range, constants_.first_lambda * range)) /
            2;
}

/// Returns Q^T K X of a completed frame to which Q has been fitted.
Detail::Field Detail::detail_turned_back(Field completed) {
  system_.apply(completed, 1, workspace_.kx);
  rotations_.turn_back(workspace_.kx, workspace_.shape);
  return workspace_.shape;
}

void Detail::remember(Frame completed) {
  const Field x = in_workspace(completed);
  fit_rotations(x);
  const Stopwatch stopwatch(report_.rotation_seconds);
  memory_.learn(detail_turned_back(x), workers_);
  if (learned_) learned_->advance(memory_.shapes(), workspace_.anchors.number > 0);
}

std::size_t Detail::memory_size() const { return stored_size(*this) + error_bars_.memory_size(); }

void Detail::write_memory(Writer& writer) const {
  write_fields(writer, *this);
  error_bars_.write_memory(writer);
}

void Detail::read_memory(Reader& reader, Frame completed) {
  read_fields(reader, *this);
  error_bars_.read_memory(reader);
  constexpr double rounding = 1e-6;
  for (const Quaternion& q : rotations_.quaternions()) {
    if (!(std::abs(q.w * q.w + q.x * q.x + q.y * q.y + q.z * q.z - 1) <= rounding)) {
      refuse_state("holds a rotation that is none");
    }
  }
  const double range = constants_.range_of_lambda;
  if (lambda_ < constants_.first_lambda / range || lambda_ > constants_.first_lambda * range) {
    refuse_state("weighs anchors as no frame can");
  }
  memory_.recall(detail_turned_back(in_workspace(completed)));
  if (learned_) learned_->recall();
  rest_fit_.recall();
}

}  // namespace dynmesh
