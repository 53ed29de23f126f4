#include "shape/detail.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>

#include "base/geometry.hpp"
#include "shape/constants.hpp"
#include "shape/continuation.hpp"
#include "shape/turn_errors.hpp"

namespace dynmesh {
namespace {

/// Of the change of the shape of a vertex in u, by its generations in the last frame and this one.
double weight_of_newest(Index before, Index now) {
  const auto is_in_hole = [](Index generation) {
    return generation == Generations::disconnected || generation > 1;
  };
  if (is_in_hole(now)) return detail_constants.newest_in_holes;
  return is_in_hole(before) ? detail_constants.newest_after_holes : detail_constants.newest;
}

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
      system_(model.k, workers),
      rotations_(model.surroundings, workers),
      anchor_rotations_(model, noise_.value_or(0), leaders, workers),
      fit_(settings.learn ? ShapeFit::Of::change : ShapeFit::Of::rest, model.topology.cells,
           workers, training_constants.largest_kept, modes),
      error_bars_(model.topology.cells, workers, settings.uncertainty,
                  noise_.has_value() ? AnchorNoise::by_weight : AnchorNoise::exact),
      first_order_(model, workers),
      growth_(model),
      anchors_(Anchors(model.size(), noise_.has_value()), 1),
      factors_(MaskedFactor(model.plan, workers)),
      fields_(std::vector<Vector3>(model.size()), 5),
      steps_(Steps(model.size()), 1),
      numbers_(std::vector<double>(model.size()), 5) {}

void Detail::begin(Memory& memory) const {
  memory.q.assign(model_.size(), {1, 0, 0, 0});
  memory.m = model_.first_shape;
  memory.completion.u.resize(model_.size());
  memory.sizes.assign(model_.topology.report.components, 1);
  memory.completion.gains.components.resize(model_.topology.report.components);
  if (model_.is_trained) memory.fit.coefficients = ShapeFit::no_coefficients();
  memory.errors = error_bars_.no_errors();
  const std::size_t n_components = model_.topology.report.components;
  if (error_bars_.exist() && n_components > 1) memory.errors.turns.resize(n_components);
}

Lent<ClusterRotations> Detail::complete(const Memory& memory, Memory& next, FrameReport& report) {
  StageReport& stages = report.stages;
  next.completion.lambda = memory.completion.lambda;
  next.completion.gains = memory.completion.gains;
  ++next.completion.gains.frame;
  next.fit = memory.fit;

  Lent<Anchors> anchors = anchors_.lend();
  anchors.set_frame(memory.last, next.last, next.generations, memory.completion.lambda);
  next.sizes = memory.sizes;
  growth_.find(next.known, anchors.observed, Growth::Since::last_frame, next.sizes);
  std::optional<ShapeFactor> factor;  // of N
  if (anchors.any_solved()) {
    const Stopwatch stopwatch(stages.factor_seconds);
    factor.emplace(anchors, factors_.lend());
  }
  Lent<ClusterRotations> rotations = turn(memory, anchors, next, stages);
  if (factor) {
    report.iterations = solve(memory, anchors, *factor, rotations.farthest, next, report);
  } else if (error_bars_.exist()) {
    error_bars_.pass(next.generations, model_.clusters(), memory.errors, next.errors);
  }
  if (!memory.errors.turns.empty()) {
    add_turn_errors(anchor_rotations_.turns(rotations, memory.departures), model_.topology,
                    next.generations, next.last, memory.errors, next.errors);
  }
  return rotations;
}

/// "Rotations before positions", (9) to (11): Q_i = D_i Q'_i. What no edge connects to an anchor
/// turns as well, even if nothing is solved for.
Lent<ClusterRotations> Detail::turn(const Memory& memory, const Anchors& anchors, Memory& next,
                                    StageReport& report) {
  const bool any_disconnected = next.generations.disconnected_vertices() > 0;
  if (!anchors.any_solved() && (anchors.number == 0 || !any_disconnected)) {
    next.q = memory.q;
    return anchor_rotations_.at_rest(anchors.number > 0);
  }
  const Stopwatch stopwatch(report.rotation_seconds);
  Lent<ClusterRotations> rotations =
      anchor_rotations_.find(memory.last, anchors.observed, next.generations, memory.departures);
  rotations_.turn_further(rotations.of_clusters, memory.q, next.q);
  return rotations;
}

/// "A frame" and what follows there. Returns how often Q was fitted and X found.
std::size_t Detail::solve(const Memory& memory, Anchors& anchors, ShapeFactor& factor,
                          Index farthest, Memory& next, FrameReport& report) {
  StageReport& stages = report.stages;
  const double of_turning = stages.rotation_seconds;
  const Stopwatch stopwatch(stages.solve_seconds);  // rotations are taken off at the end

  // "Growth": from here on, all positions are in the sizes of frame 0.
  const std::span<const double> sizes = next.sizes;
  std::optional<LentField> shrunk;
  if (any_grown(memory.sizes) || any_grown(sizes)) {
    shrunk.emplace(in_first_sizes(memory, next, anchors));
  }
  const Field last = shrunk ? Field(*shrunk) : Field(memory.last);

  // Step 1: Q of what is far from all anchors follows from the X that minimises |K X - Q m|^2.
  // Modes leave so small an error that it pays everywhere.
  LentField x = copy_of(anchors.observed);
  LentField kx = detail_of(x);
  const bool is_refined = fit_.exists() || farthest > increment_constants.near;
  if (is_refined) {
    x = moved_to(turned(next.q, memory.m), x, kx, factor);
    fit_rotations(x, next, stages);
    kx = detail_of(x);
  }

  // Step 2: r0, r1 and r2, with modes B a (14) in m_first or m, and the global b and c.
  Lent<Steps> steps = steps_towards(memory, next.q, x, kx, factor);
  const ResidualField residuals = {
      anchors, x, kx, steps.wanted, steps.steps, steps.k_steps, model_.rounding.mean_square(x)};
  const Lent<AddedShape> added = fit_.find(residuals, factor, system_, next.q, next.fit);
  add_modes(added, steps);
  const Blend blend = global_blend(residuals, model_.mean_edge);

  // Step 3: the local b_i, and X of step 2.
  const auto b = local_blend(residuals, blend, model_.clusters(), numbers_, workers_);
  workers_.for_each_in_chunks(x.size(), [&](std::size_t v) {
    x[v] = x[v] + blend.of(steps.steps[v]);
    kx[v] = kx[v] + blend.of(steps.k_steps[v]);
  });

  // Step 4: Q of that X, and what known rows show of the shape goes on into holes. Step 5: the X
  // that minimises (12).
  fit_rotations(x, next, stages);
  LentField shape = shape_of(memory, added, b, blend.c);
  continue_seen(next, kx, shape);
  dynmesh::turn(next.q, shape, shape, workers_);
  x = moved_to(shape, x, kx, factor);

  // "Noise and outliers", "Standard errors".
  if (noise_ || error_bars_.exist()) kx = detail_of(x);
  if (noise_) {
    next.completion.lambda = next_lambda(memory.completion.lambda, sizes, x, kx, shape, anchors);
  }
  if (error_bars_.exist()) {
    error_bars_.update({x, kx, shape, residuals.rounding}, factor, next.generations, system_,
                       model_.clusters(), memory.errors, next.errors);
  }

  // "The first-order steps": X + s (Y - X), with Y of (13).
  const auto first_order = first_order_.improve({last, x, shape, anchors.observed},
                                                next.generations, next.completion.gains);
  for (std::size_t v = 0; v < x.size(); ++v) {
    if (anchors.is_solved[v] != 0) {
      const Vector3 moved = first_order.share > 0 ? x[v] + first_order.move[v] : x[v];
      next.last[v] = size_of(v, sizes) * moved;
    }
    if (error_bars_.exist()) next.errors.standard_errors[v] *= size_of(v, sizes);
  }

  stages.prior_weight = added.weight;
  if (fit_.exists()) stages.prior_share = next.fit.prior_share;
  stages.first_order_share = first_order.share;
  stages.blend = blend.b;
  stages.solve_seconds -= stages.rotation_seconds - of_turning;
  return is_refined ? 2 : 1;
}

void Detail::fit_rotations(Field positions, Memory& next, StageReport& report) {
  const Stopwatch stopwatch(report.rotation_seconds);
  rotations_.fit(positions, next.q);
}

/// The frame before, and in place the observed positions, in the sizes of frame 0.
LentField Detail::in_first_sizes(const Memory& memory, const Memory& next, Anchors& anchors) {
  const auto generation = next.generations.of_vertices();
  LentField last = fields_.lend();
  for (std::size_t v = 0; v < last.size(); ++v) {
    last[v] = 1 / size_of(v, memory.sizes) * memory.last[v];
    anchors.observed[v] = generation[v] == Generations::anchor
                              ? 1 / size_of(v, next.sizes) * anchors.observed[v]
                              : last[v];
  }
  return last;
}

LentField Detail::copy_of(Field field) {
  LentField copy = fields_.lend();
  std::ranges::copy(field, copy.begin());
  return copy;
}

/// K X
LentField Detail::detail_of(Field positions) {
  LentField detail = fields_.lend();
  system_.apply(positions, 1, detail);
  return detail;
}

/// Q m
LentField Detail::turned(std::span<const Quaternion> q, Field shape) {
  LentField result = fields_.lend();
  dynmesh::turn(q, shape, result, workers_);
  return result;
}

/// The positions whose detail is closest to a turned shape: N dX = K^T (shape - K X).
LentField Detail::moved_to(Field shape, Field x, Field kx, ShapeFactor& factor) {
  const auto residual = [&](std::size_t v, std::size_t) { return shape[v] - kx[v]; };
  LentField moved = fields_.lend();
  system_.solve<1>(residual, x, factor, moved);
  workers_.for_each_in_chunks(x.size(), [&](std::size_t v) { moved[v] = x[v] + moved[v]; });
  return moved;
}

/// The best steps towards Q m, and those that a unit of b and of c add.
auto Detail::steps_towards(const Memory& memory, std::span<const Quaternion> q, Field x, Field kx,
                           ShapeFactor& factor) -> Lent<Steps> {
  Lent<Steps> found = steps_.lend();
  workers_.for_each_in_chunks(q.size(), [&](std::size_t v) { found.wanted[v] = terms(memory, v); });
  dynmesh::turn(q, found.wanted, found.wanted, workers_);
  system_.solve_terms(found.wanted, x, kx, factor, found.steps);
  system_.apply(found.steps, found.k_steps);
  return found;
}

/// Adds what modes explain of the anchors.
void Detail::add_modes(const AddedShape& added, Steps& to) const {
  const double k = added.weight;
  if (k == 0) return;
  for (std::size_t v = 0; v < to.steps.size(); ++v) {
    fit_.add(k * added.wanted[v], to.wanted[v]);
    fit_.add(k * added.steps[v], to.steps[v]);
    fit_.add(k * added.k_steps[v], to.k_steps[v]);
  }
}

/// m_i + b_i (m_first - m_i) + c u_i, with what modes add.
LentField Detail::shape_of(const Memory& memory, const AddedShape& added, std::span<const double> b,
                           double c) {
  LentField shape = fields_.lend();
  workers_.for_each_in_chunks(shape.size(), [&](std::size_t v) {
    ShapeTerms of = terms(memory, v);
    if (added.weight > 0) fit_.add(added.weight * added.shape[v], of);
    shape[v] = Blend{b[v], c}.of(of);
  });
  return shape;
}

/// What known rows show of the shape goes on into holes.
void Detail::continue_seen(const Memory& next, Field kx, std::span<Vector3> shape) {
  LentField seen = fields_.lend();
  turn_back(next.q, kx, seen, workers_);
  continue_into_holes(model_.topology.cells, next.generations, seen, shape);
}

/// Computes lambda for the next frame from the error of the shape per coordinate, sigma_L^2 = (E +
/// lambda |q|^2) / (3 anchors), where E is the energy and q the displacement of the anchors from
/// their observed positions.
double Detail::next_lambda(double lambda, std::span<const double> sizes, Field x, Field kx,
                           Field shape, const Anchors& anchors) const {
  double energy = 0;
  for (std::size_t v = 0; v < shape.size(); ++v) {
    energy += std::pow(size_of(v, sizes), 2) *
              (anchors.counts[v] * squared_norm(kx[v] - shape[v]) +
               anchors.weights[v] * squared_norm(x[v] - anchors.observed[v]));
  }
  if (!std::isfinite(energy)) return lambda;
  // The square of a small noise would be 0. Any noise that is small enough has the largest lambda.
  const double found = energy / (3 * static_cast<double>(anchors.number)) / *noise_ / *noise_;
  const double range = detail_constants.range_of_lambda;
  return (lambda + std::clamp(found, detail_constants.first_lambda / range,
                              detail_constants.first_lambda * range)) /
         2;
}

void Detail::remember(const Memory& memory, Memory& next, StageReport& report) {
  fit_rotations(next.last, next, report);
  const Stopwatch stopwatch(report.rotation_seconds);
  turn_back(next.q, detail_of(next.last), next.m, workers_);
  const std::span<const double> sizes = next.sizes;
  if (any_grown(sizes)) {
    for (std::size_t v = 0; v < next.m.size(); ++v) next.m[v] = 1 / size_of(v, sizes) * next.m[v];
  }
  workers_.for_each_in_chunks(next.m.size(), [&](std::size_t v) {
    const auto newest = next.m[v] - memory.m[v];
    // A jump by a mean edge length or more is considered an error, and u is reset.
    const bool is_jump = !(squared_norm(newest) < model_.mean_edge * model_.mean_edge);
    const double weight =
        weight_of_newest(memory.generations.of_vertices()[v], next.generations.of_vertices()[v]);
    const auto mean = (1 - weight) * memory.completion.u[v] + weight * newest;
    next.completion.u[v] = is_jump ? Vector3{} : mean;
  });
}

}  // namespace dynmesh
