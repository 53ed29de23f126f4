#include "shape/detail.hpp"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <utility>

#include "base/geometry.hpp"
#include "shape/constants.hpp"

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

Detail::Detail(Frame first_frame, std::span<const Triangle> faces, const Topology& topology,
               const TrainingFrames& training, Workers& workers, const Settings& settings,
               double epsilon)
    : topology_(topology),
      workers_(workers),
      noise_(settings.noise),
      mean_edge_(mean_edge_length(topology.cells, first_frame)),
      system_(faces, topology.cells, workers, first_frame),
      rounding_(system_.k(), mean_edge_, epsilon),
      rotations_(topology.cells, workers, first_frame, mean_edge_),
      increments_(topology, rotations_.clusters(), first_frame, mean_edge_, noise_.value_or(0),
                  workers),
      local_blend_(rotations_.clusters(), workers),
      is_trained_(!training.empty()),
      fit_(settings.learn ? ShapeFit::Of::change : ShapeFit::Of::rest, topology.cells, workers,
           training_constants.largest_kept,
           settings.learn ? Modes(divide_surface(topology.cells, first_frame), mean_edge_)
                          : training_modes(training, system_.k(), topology.cells, first_frame,
                                           mean_edge_, rounding_, workers)),
      error_bars_(topology.cells, workers, settings.uncertainty,
                  noise_.has_value() ? AnchorNoise::by_weight : AnchorNoise::exact),
      first_order_(topology, system_.k(), rounding_, workers, noise_.has_value()),
      next_generations_(first_frame.size()),
      first_shape_(first_frame.size()),
      shapes_(first_frame.size()),
      lambda_(detail_constants.first_lambda),
      anchors_(first_frame.size(), noise_.has_value()),
      x_(first_frame.begin(), first_frame.end()),
      kx_(x_.size()),
      shape_(x_.size()),
      turned_(x_.size()),
      k_steps_(x_.size()) {
  if (settings.learn) {
    library_ = std::make_unique<ShapeLibrary>(fit_.modes(), training_constants.most_learned,
                                              mean_edge_, rounding_.mean_square(x_), workers);
  }
  if (settings.learn || is_trained_) {
    steps_.resize(x_.size());
    fitted_.resize(x_.size());
  }
  system_.apply(x_, 1, first_shape_);
  for (std::size_t v = 0; v < x_.size(); ++v) shapes_[v].last = first_shape_[v];
}

Index Detail::estimate(Frame previous, std::span<Vector3<double>> points,
                       std::span<const std::uint8_t> known, Generations& generations) {
  report_ = {};
  next_generations_.classify(topology_.cells, known);
  anchors_.set_frame(previous, points, next_generations_, lambda_);
  if (anchors_.any_solved()) {
    const Stopwatch stopwatch(report_.factor_seconds);
    system_.factorize(anchors_);  // may throw
  }
  std::swap(generations, next_generations_);
  first_order_.count_frame();
  // What no edge connects to an anchor turns with the increments, even if nothing is solved for.
  const bool any_disconnected = generations.disconnected_vertices() > 0;
  if (anchors_.any_solved() || (anchors_.number > 0 && any_disconnected)) {
    turn_with_anchors(previous, generations);
  }
  if (!anchors_.any_solved()) {
    if (error_bars_.exist()) error_bars_.pass(generations, rotations_.clusters());
    return 0;
  }

  const double of_increments = report_.rotation_seconds;
  const Stopwatch stopwatch(report_.solve_seconds);  // rotations are taken off at the end

  // Step 1: Q of what is far from all anchors follows from the positions with the last shape. Modes
  // leave so small an error that it pays everywhere.
  std::ranges::copy(anchors_.observed, x_.begin());
  system_.apply(x_, 1, kx_);
  const bool is_refined = fit_.exists() || increments_.farthest() > increment_constants.near;
  if (is_refined) {
    for (std::size_t v = 0; v < x_.size(); ++v) shape_[v] = shapes_[v].last;
    move_to_shape();
    fit_rotations(x_);
    system_.apply(x_, 1, kx_);
  }

  // Step 2: find the global b and c. With modes, a fitted shape takes the place of m_first or m.
  ResidualField directions = find_directions();
  FittedModes found = {.prior_weight = 0};
  if (fit_.exists()) found = add_modes(directions);
  const Blend blend = global_blend(directions, mean_edge_);

  // Step 3: find the local b_i.
  const std::span<const double> b = local_blend_.find(directions, blend);
  workers_.for_each_in_chunks(x_.size(), [&](std::size_t v) {
    x_[v] = x_[v] + blend.of(directions.steps[v]);
    kx_[v] = kx_[v] + blend.of(directions.k_steps[v]);
  });

  // Step 4: fit rotations and solve again.
  fit_rotations(x_);
  const std::span<const ShapeTerms> shapes = found.prior_weight > 0 ? fitted_ : shapes_;
  workers_.for_each_in_chunks(x_.size(), [&](std::size_t v) {
    shape_[v] = Blend{b[v], blend.c}.of(shapes[v]);
  });
  move_to_shape();

  if (noise_ || error_bars_.exist()) system_.apply(x_, 1, kx_);
  if (noise_) weigh_anchors();
  if (error_bars_.exist()) {
    error_bars_.update({x_, kx_, shape_, directions.rounding}, anchors_, generations, system_,
                       rotations_.clusters());
  }

  // Step 5: move the satellites by a share of the first-order step.
  report_.first_order_share =
      first_order_.improve({previous, x_, shape_}, anchors_, generations, system_);
  for (std::size_t v = 0; v < points.size(); ++v) {
    if (anchors_.is_solved[v] != 0) points[v] = x_[v];
  }
  report_.blend = blend.b;
  report_.solve_seconds -= report_.rotation_seconds - of_increments;
  return is_refined ? 2 : 1;
}

void Detail::turn_with_anchors(Frame previous, const Generations& generations) {
  const Stopwatch stopwatch(report_.rotation_seconds);
  rotations_.turn_further(increments_.find(previous, anchors_.observed, generations));
}

void Detail::fit_rotations(Field positions) {
  const Stopwatch stopwatch(report_.rotation_seconds);
  rotations_.fit(positions);
}

/// Computes the steps towards Q m, those that a unit of b and of c add, and the residuals they
/// leave.
ResidualField Detail::find_directions() {
  rotations_.turn(shapes_, turned_);
  const auto steps = system_.solve_terms(turned_, x_, kx_, anchors_);
  system_.apply(steps, k_steps_);
  return {anchors_, x_, kx_, turned_, steps, k_steps_, rounding_.mean_square(x_)};
}

/// Adds what modes explain of the anchors to the shapes, and to the directions.
FittedModes Detail::add_modes(ResidualField& directions) {
  system_.keep_steps(steps_);  // the next solutions overwrite them
  directions.steps = steps_;
  const FittedModes found = fit_.find(directions, system_, rotations_);
  const double k = found.prior_weight;
  report_.prior_weight = k;
  report_.prior_share = found.prior_share;
  if (k == 0) return found;
  std::ranges::copy(shapes_, fitted_.begin());
  const AddedShape& added = fit_.added();
  for (std::size_t v = 0; v < fitted_.size(); ++v) {
    fit_.add(k * added.shape[v], fitted_[v]);
    fit_.add(k * added.wanted[v], turned_[v]);
    fit_.add(k * added.steps[v], steps_[v]);
    fit_.add(k * added.k_steps[v], k_steps_[v]);
  }
  return found;
}

/// Moves the positions to those whose detail is closest to the shape, turned by Q. K X is known.
void Detail::move_to_shape() {
  rotations_.turn(shape_, shape_);
  const auto step = system_.solve<1>([&](std::size_t v, std::size_t) { return shape_[v] - kx_[v]; },
                                     x_, anchors_);
  workers_.for_each_in_chunks(x_.size(), [&](std::size_t v) { x_[v] = x_[v] + step[v]; });
}

/// Computes lambda for the next frame from the error of the shape per coordinate, sigma_L^2 = (E +
/// lambda |q|^2) / (3 anchors), where E is the energy and q the displacement of the anchors from
/// their observed positions.
void Detail::weigh_anchors() {
  double energy = 0;
  for (std::size_t v = 0; v < shape_.size(); ++v) {
    energy += anchors_.counts[v] * squared_norm(kx_[v] - shape_[v]);
    energy += anchors_.weights[v] * squared_norm(x_[v] - anchors_.observed[v]);
  }
  if (!std::isfinite(energy)) return;
  // The square of a small noise would be 0. Any noise that is small enough has the largest lambda.
  const double found = energy / (3 * static_cast<double>(anchors_.number)) / *noise_ / *noise_;
  const double range = detail_constants.range_of_lambda;
  lambda_ = (lambda_ + std::clamp(found, detail_constants.first_lambda / range,
                                  detail_constants.first_lambda * range)) /
            2;
}

/// Returns Q^T K X of a completed frame to which Q has been fitted.
Detail::Field Detail::detail_turned_back(Frame completed) {
  system_.apply(completed, 1, kx_);
  rotations_.turn_back(kx_, shape_);
  return shape_;
}

void Detail::remember(Frame completed) {
  fit_rotations(completed);
  const Stopwatch stopwatch(report_.rotation_seconds);
  const Field detail = detail_turned_back(completed);
  workers_.for_each_in_chunks(detail.size(), [&](std::size_t v) {
    const auto newest = detail[v] - shapes_[v].last;
    // A jump by a mean edge length or more is considered an error, and u is reset.
    const bool is_jump = !(squared_norm(newest) < mean_edge_ * mean_edge_);
    const auto mean =
        (1 - detail_constants.newest) * shapes_[v].change + detail_constants.newest * newest;
    shapes_[v] = {detail[v], first_shape_[v] - detail[v], is_jump ? Vector3<double>{} : mean};
  });
  if (library_ && anchors_.number > 0) learn();
}

/// Adds some of the frames to the library, and makes new modes.
void Detail::learn() {
  if (++n_evident_ % training_constants.learned_interval != 0) return;
  const double largest = training_constants.largest_learned * mean_edge_;
  const auto is_small = [&](double x) { return std::abs(x) <= largest; };
  const bool is_possible = std::ranges::all_of(shapes_, [&](const ShapeTerms& shape) {
    const auto& [x, y, z, unused] = shape.to_rest;
    return is_small(x) && is_small(y) && is_small(z);
  });
  if (!is_possible) return;
  library_->add([&](std::size_t v) { return -1.0 * shapes_[v].to_rest; });
  if (library_->size() > 1) fit_.learn(*library_);
}

void Detail::write_memory(Writer& writer) const {
  write_fields(writer, *this);
  error_bars_.write_memory(writer);
}

void Detail::read_memory(Reader& reader, Frame completed) {
  read_fields(reader, *this);
  error_bars_.read_memory(reader);
  check_stored(rotations_.quaternions());
  const double range = detail_constants.range_of_lambda;
  if (lambda_ < detail_constants.first_lambda / range ||
      lambda_ > detail_constants.first_lambda * range) {
    refuse_state("weighs anchors as no frame can");
  }
  const Field detail = detail_turned_back(completed);
  for (std::size_t v = 0; v < detail.size(); ++v) {
    shapes_[v].last = detail[v];
    shapes_[v].to_rest = first_shape_[v] - detail[v];
  }
  if (library_) {
    library_->recall();
    if (library_->size() > 1) fit_.learn(*library_);
  }
  fit_.recall();
}

}  // namespace dynmesh
