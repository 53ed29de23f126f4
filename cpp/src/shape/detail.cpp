#include "shape/detail.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <utility>

#include "base/geometry.hpp"
#include "shape/constants.hpp"
#include "shape/turn_errors.hpp"

namespace dynmesh {
namespace {

/// Adds the duration of its scope to `seconds`.
class Stopwatch {
 public:
  explicit Stopwatch(double& seconds) : seconds_(seconds) {}
  ~Stopwatch() { seconds_ += std::chrono::duration<double>(Clock::now() - start_).count(); }

 private:
  using Clock = std::chrono::steady_clock;

  double& seconds_;
  Clock::time_point start_ = Clock::now();
};

}  // namespace

Detail::Detail(const ShapeModel& model, const Modes& modes, const Settings& settings,
               Leaders& leaders, Workers& workers)
    : model_(model),
      noise_(settings.noise),
      workers_(workers),
      system_(model.k, model.plan, workers),
      rotations_(model.surroundings, workers),
      increments_(model, noise_.value_or(0), leaders, workers),
      local_blend_(model.clusters(), workers),
      fit_(settings.learn ? ShapeFit::Of::change : ShapeFit::Of::rest, model.topology.cells,
           workers, training_constants.largest_kept, modes),
      error_bars_(model.topology.cells, workers, settings.uncertainty,
                  noise_.has_value() ? AnchorNoise::by_weight : AnchorNoise::exact),
      first_order_(model, workers),
      growth_(model),
      still_(model.topology.report.components),
      anchors_(model.size(), noise_.has_value()),
      last_(model.size()),
      x_(model.size()),
      kx_(model.size()),
      shape_(model.size()),
      move_(model.size()),
      turned_(model.size()),
      steps_(model.size()),
      k_steps_(model.size()) {}

void Detail::begin(Memory& memory) const {
  memory.q.assign(model_.size(), {1, 0, 0, 0});
  memory.m = model_.first_shape;
  memory.completion.u.resize(model_.size());
  memory.completion.sizes.assign(model_.topology.report.components, 1);
  memory.completion.gains.components.resize(model_.topology.report.components);
  if (model_.is_trained) memory.fit.coefficients = ShapeFit::no_coefficients();
  memory.errors = error_bars_.no_errors();
  const std::size_t n_components = model_.topology.report.components;
  if (error_bars_.exist() && n_components > 1) memory.errors.turns.resize(n_components);
}

std::size_t Detail::estimate(const Memory& memory, Memory& next, StageReport& report) {
  const Generations& generations = next.generations;
  anchors_.set_frame(memory.last, next.last, generations, memory.completion.lambda);
  growth_.find(memory, anchors_.observed, next);
  if (anchors_.any_solved()) {
    const Stopwatch stopwatch(report.factor_seconds);
    system_.factorize(anchors_);
  }
  next.completion.lambda = memory.completion.lambda;
  next.fit = memory.fit;
  next.completion.gains = memory.completion.gains;
  ++next.completion.gains.frame;
  // What no edge connects to an anchor turns with the increments, even if nothing is solved for.
  const bool any_disconnected = generations.disconnected_vertices() > 0;
  const bool are_turned = anchors_.any_solved() || (anchors_.number > 0 && any_disconnected);
  if (are_turned) {
    const Stopwatch stopwatch(report.rotation_seconds);
    rotations_.turn_further(
        increments_.find(memory.last, anchors_.observed, generations, memory.departures), memory.q,
        next.q);
  } else {
    next.q = memory.q;
  }
  if (!anchors_.any_solved()) {
    if (error_bars_.exist()) {
      error_bars_.pass(generations, model_.clusters(), memory.errors, next.errors);
      add_turn_errors(memory, next, are_turned);
    }
    return 0;
  }

  const double of_increments = report.rotation_seconds;
  const Stopwatch stopwatch(report.solve_seconds);  // rotations are taken off at the end

  // From here on, all positions are in the sizes of frame 0.
  const std::span<const double> sizes = next.completion.sizes;
  const bool is_grown = any_grown(memory.completion.sizes) || any_grown(sizes);
  const Field last = is_grown ? Field(last_) : Field(memory.last);
  if (is_grown) {
    for (std::size_t v = 0; v < x_.size(); ++v) {
      last_[v] = 1 / size_of(v, memory.completion.sizes) * memory.last[v];
      const bool is_anchor = generations.of_vertices()[v] == Generations::anchor;
      anchors_.observed[v] = is_anchor ? 1 / size_of(v, sizes) * anchors_.observed[v] : last_[v];
    }
  }

  // Step 1: Q of what is far from all anchors follows from the positions with the last shape. Modes
  // leave so small an error that it pays everywhere.
  std::ranges::copy(anchors_.observed, x_.begin());
  system_.apply(x_, 1, kx_);
  const bool is_refined = fit_.exists() || increments_.farthest() > increment_constants.near;
  if (is_refined) {
    turn(next.q, memory.m, shape_, workers_);
    move_to_shape();
    fit_rotations(x_, next, report);
    system_.apply(x_, 1, kx_);
  }

  // Step 2: find the global b and c. With modes, a fitted shape takes the place of m_first or m.
  const ResidualField directions = find_directions(memory, next.q);
  double k = 0;
  if (fit_.exists()) {
    add_modes(directions, next);
    k = report.prior_weight = next.fit.prior_weight;
    report.prior_share = next.fit.prior_share;
  }
  const Blend blend = global_blend(directions, model_.mean_edge);

  // Step 3: find the local b_i.
  const std::span<const double> b = local_blend_.find(directions, blend);
  workers_.for_each_in_chunks(x_.size(), [&](std::size_t v) {
    x_[v] = x_[v] + blend.of(directions.steps[v]);
    kx_[v] = kx_[v] + blend.of(directions.k_steps[v]);
  });

  // Step 4: fit rotations and solve again.
  fit_rotations(x_, next, report);
  workers_.for_each_in_chunks(x_.size(), [&](std::size_t v) {
    ShapeTerms shape = terms(memory, v);
    if (k > 0) fit_.add(k * fit_.added().shape[v], shape);
    shape_[v] = Blend{b[v], blend.c}.of(shape);
  });
  turn(next.q, shape_, shape_, workers_);
  move_to_shape();

  if (noise_ || error_bars_.exist()) system_.apply(x_, 1, kx_);
  if (noise_) next.completion.lambda = next_lambda(memory.completion.lambda, sizes);
  if (error_bars_.exist()) {
    error_bars_.update({x_, kx_, shape_, directions.rounding}, anchors_, generations, system_,
                       model_.clusters(), memory.errors, next.errors);
  }

  // Step 5: move the satellites by a share of the first-order step.
  report.first_order_share = first_order_.improve({last, x_, shape_, anchors_.observed},
                                                  generations, next.completion.gains);
  for (std::size_t v = 0; v < x_.size(); ++v) {
    if (anchors_.is_solved[v] != 0) next.last[v] = size_of(v, sizes) * x_[v];
    if (error_bars_.exist()) next.errors.standard_errors[v] *= size_of(v, sizes);
  }
  if (error_bars_.exist()) add_turn_errors(memory, next, are_turned);
  report.blend = blend.b;
  report.solve_seconds -= report.rotation_seconds - of_increments;
  return is_refined ? 2 : 1;
}

void Detail::add_turn_errors(const Memory& memory, Memory& next, bool are_turned) {
  if (memory.errors.turns.empty()) return;
  Turn still;  // everything is known, or nothing
  still.axes = anchors_.number > 0 ? 3 : 0;
  std::ranges::fill(still_, still);
  dynmesh::add_turn_errors(are_turned ? increments_.turns(memory.departures) : still_,
                           model_.topology, next.generations, next.last, memory.errors,
                           next.errors);
}

void Detail::fit_rotations(Field positions, Memory& next, StageReport& report) {
  const Stopwatch stopwatch(report.rotation_seconds);
  rotations_.fit(positions, next.q);
}

/// Computes the steps towards Q m, those that a unit of b and of c add, and the residuals they
/// leave.
ResidualField Detail::find_directions(const Memory& memory, std::span<const Quaternion> q) {
  const std::span<Vector3> turned = side_by_side(std::span(turned_));
  // So few at once that they stay in the first-level cache.
  constexpr Index together = 128;
  workers_.for_each_short_chunk(static_cast<Index>(q.size()), [&](Index begin, Index end) {
    for (Index first = begin; first < end; first += together) {
      const Index last = std::min(first + together, end);
      for (Index v = first; v < last; ++v) turned_[v] = terms(memory, at(v));
      best_kernels().rotations.turn(q.data(), false, turned.data(), 3, turned.data(), first, last);
    }
  });
  system_.solve_terms(turned_, x_, kx_, anchors_, steps_);
  system_.apply(steps_, k_steps_);
  return {anchors_, x_, kx_, turned_, steps_, k_steps_, model_.rounding.mean_square(x_)};
}

/// Adds what modes explain of the anchors to the directions.
void Detail::add_modes(const ResidualField& directions, Memory& next) {
  fit_.find(directions, system_, next.q, next.fit);
  const double k = next.fit.prior_weight;
  if (k == 0) return;
  const AddedShape& added = fit_.added();
  for (std::size_t v = 0; v < steps_.size(); ++v) {
    fit_.add(k * added.wanted[v], turned_[v]);
    fit_.add(k * added.steps[v], steps_[v]);
    fit_.add(k * added.k_steps[v], k_steps_[v]);
  }
}

/// Moves the positions to those whose detail is closest to the turned shape. K X is known.
void Detail::move_to_shape() {
  const auto residual = [&](std::size_t v, std::size_t) { return shape_[v] - kx_[v]; };
  system_.solve<1>(residual, x_, anchors_, move_);
  workers_.for_each_in_chunks(x_.size(), [&](std::size_t v) { x_[v] = x_[v] + move_[v]; });
}

/// Computes lambda for the next frame from the error of the shape per coordinate, sigma_L^2 = (E +
/// lambda |q|^2) / (3 anchors), where E is the energy and q the displacement of the anchors from
/// their observed positions.
double Detail::next_lambda(double lambda, std::span<const double> sizes) const {
  double energy = 0;
  for (std::size_t v = 0; v < shape_.size(); ++v) {
    energy += std::pow(size_of(v, sizes), 2) *
              (anchors_.counts[v] * squared_norm(kx_[v] - shape_[v]) +
               anchors_.weights[v] * squared_norm(x_[v] - anchors_.observed[v]));
  }
  if (!std::isfinite(energy)) return lambda;
  // The square of a small noise would be 0. Any noise that is small enough has the largest lambda.
  const double found = energy / (3 * static_cast<double>(anchors_.number)) / *noise_ / *noise_;
  const double range = detail_constants.range_of_lambda;
  return (lambda + std::clamp(found, detail_constants.first_lambda / range,
                              detail_constants.first_lambda * range)) /
         2;
}

void Detail::remember(const Memory& memory, Memory& next, StageReport& report) {
  fit_rotations(next.last, next, report);
  const Stopwatch stopwatch(report.rotation_seconds);
  system_.apply(next.last, 1, kx_);
  turn_back(next.q, kx_, next.m, workers_);
  const std::span<const double> sizes = next.completion.sizes;
  if (any_grown(sizes)) {
    for (std::size_t v = 0; v < kx_.size(); ++v) {
      next.m[v] = 1 / size_of(v, sizes) * next.m[v];
    }
  }
  workers_.for_each_in_chunks(next.m.size(), [&](std::size_t v) {
    const auto newest = next.m[v] - memory.m[v];
    // A jump by a mean edge length or more is considered an error, and u is reset.
    const bool is_jump = !(squared_norm(newest) < model_.mean_edge * model_.mean_edge);
    const auto mean =
        (1 - detail_constants.newest) * memory.completion.u[v] + detail_constants.newest * newest;
    next.completion.u[v] = is_jump ? Vector3{} : mean;
  });
}

}  // namespace dynmesh
