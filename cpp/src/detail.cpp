#include "detail.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "geometry.hpp"
#include "stopwatch.hpp"

namespace dynmesh {
namespace {

/// Rounds of turning and solving: the first finds the blend.
constexpr Index rounds = 3;

OperatorData data_of(const DetailOperator& k) {
  return {k.offsets.data(), k.columns.data(), k.values.data(), k.scale.data()};
}

}  // namespace

template <class Real>
Detail<Real>::Detail(std::vector<Triangle> faces, const Topology& topology,
                     std::optional<double> noise, Workers& workers)
    : faces_(std::move(faces)),
      topology_(topology),
      workers_(workers),
      kernels_(*runnable_operator_kernels().front()),
      rotations_(topology.cells, workers),
      local_blend_(topology.cells),
      next_generations_(topology.cells.size()),
      solved_(topology.cells.size()),
      is_anchor_(topology.cells.size()),
      counts_(topology.cells.size()),
      blend_fits_(topology.cells.size()),
      anchor_weights_(noise ? topology.cells.size() : 0),
      noise_(noise) {
  const std::size_t k = topology.cells.size();
  for (Field* field : {&first_memory_, &observed_, &x_, &kx_, &step_, &target_, &last_memory_}) {
    field->resize(k);
  }
  for (Field* field : {&memory_, &turned_, &residual_, &solution_, &steps_, &k_step_}) {
    field->resize(3 * k);
  }
}

template <class Real>
void Detail<Real>::reset(Frame first_frame) {
  auto k = build_detail_operator<Real>(faces_, topology_.cells, first_frame);
  factor_ = std::make_unique<MaskedFactor>(normal_matrix(k));  // the last that may fail
  operator_ = std::move(k);
  take(first_frame);
  mean_edge_ = static_cast<double>(mean_edge_length(topology_.cells, first_frame));
  rotations_.reset(x_, mean_edge_);
  apply_operator(x_, 1, first_memory_);
  for (std::size_t v = 0; v < x_.size(); ++v) {
    memory_[3 * v] = first_memory_[v];
    memory_[3 * v + 1] = {};
    memory_[3 * v + 2] = {};
  }
  weight_ = first_weight;
  report_ = {};
}

template <class Real>
void Detail<Real>::take(Frame frame) {
  for (std::size_t v = 0; v < frame.size(); ++v) x_[v] = in_double(frame[v]);
}

/// products = K x.
template <class Real>
void Detail<Real>::apply_operator(const Field& x, int fields, Field& products) {
  const OperatorData k = data_of(operator_);
  workers_.for_each_short_stretch(n_vertices(), [&](Index first, Index last) {
    kernels_.apply(k, x.data(), fields, products.data(), first, last);
  });
}

/// The steps that bring K X closest to itself plus M^1/2 times residual_; the first field of them
/// also takes noisy anchors closer to where they were observed.
template <class Real>
void Detail<Real>::solve(int fields, Field& steps) {
  const auto rows = factor_->order();
  const OperatorData k = data_of(operator_);
  workers_.for_each_short_stretch(static_cast<Index>(rows.size()), [&](Index first, Index last) {
    kernels_.apply_transposed(k, residual_.data(), fields, rows.data(), solution_.data(), first,
                              last);
  });
  const auto width = static_cast<std::size_t>(fields);
  if (noise_) {
    for (std::size_t r = 0; r < rows.size(); ++r) {
      const auto v = static_cast<std::size_t>(rows[r]);
      solution_[width * r] = solution_[width * r] + anchor_weights_[v] * (observed_[v] - x_[v]);
    }
  }
  factor_->solve(solution_, fields);
  for (std::size_t r = 0; r < rows.size(); ++r) {
    const auto v = static_cast<std::size_t>(rows[r]);
    for (std::size_t f = 0; f < width; ++f) steps[width * v + f] = solution_[width * r + f];
  }
}

template <class Real>
Index Detail<Real>::estimate(Frame previous, std::span<Vector3<Real>> points,
                             std::span<const std::uint8_t> known, Generations& generations) {
  report_ = {};
  next_generations_.classify(topology_.cells, known);
  const bool is_empty =
      next_generations_.reached() == 0 && (!noise_ || next_generations_.anchors() == 0);
  if (!is_empty) {
    take_anchors(previous, points, next_generations_);
    const Stopwatch stopwatch(report_.factor_seconds);
    factor_->factorize(solved_, anchor_weights_);  // the last that may fail
  }
  std::swap(generations, next_generations_);
  if (is_empty) return 0;
  {
    const Stopwatch stopwatch(report_.solve_seconds);
    move_smoothly();
  }
  fit_rotations();
  const Blend found = solve_for_blend();
  const auto blend = local_blend_.find(blend_fits_, found.b);
  for (Index round = 1; round < rounds; ++round) {
    fit_rotations();
    solve_for(blend, found.c);
  }
  if (noise_) weigh_anchors();
  for (const Index solved : factor_->order()) {
    const auto v = static_cast<std::size_t>(solved);
    points[v] = {saturated<Real>(x_[v].x), saturated<Real>(x_[v].y), saturated<Real>(x_[v].z)};
  }
  return rounds;
}

template <class Real>
void Detail<Real>::take_anchors(Frame previous, std::span<const Vector3<Real>> points,
                                const Generations& generations) {
  take(previous);
  const auto generation = generations.of_vertices();
  for (std::size_t v = 0; v < generation.size(); ++v) {
    const bool is_anchor = generation[v] == Generations::anchor;
    is_anchor_[v] = is_anchor ? 1 : 0;
    counts_[v] = generation[v] != Generations::unseen ? 1 : 0;
    solved_[v] = generation[v] > 0 || (noise_ && is_anchor) ? 1 : 0;
    observed_[v] = is_anchor ? in_double(points[v]) : x_[v];
    if (noise_) anchor_weights_[v] = is_anchor ? weight_ : 0;
  }
}

/// The smoothest motion from the last frame that the anchors allow: min |K (X - X_prev)|^2.
template <class Real>
void Detail<Real>::move_smoothly() {
  if (noise_) {
    std::ranges::fill(residual_, Vector3<double>{});
  } else {
    for (std::size_t v = 0; v < x_.size(); ++v) step_[v] = observed_[v] - x_[v];
    apply_operator(step_, 1, k_step_);
    for (std::size_t v = 0; v < x_.size(); ++v) {
      residual_[v] = -operator_.scale[v] * k_step_[v];
      x_[v] = observed_[v];
    }
  }
  take_step();
}

/// Solves for the one field in residual_.
template <class Real>
void Detail<Real>::take_step() {
  solve(1, step_);
  for (const Index solved : factor_->order()) {
    const auto v = static_cast<std::size_t>(solved);
    x_[v] = x_[v] + step_[v];
  }
  apply_operator(x_, 1, kx_);
}

/// And turns the memory by them.
template <class Real>
void Detail<Real>::fit_rotations() {
  const Stopwatch stopwatch(report_.rotation_seconds);
  rotations_.fit(x_);
  workers_.for_each_short_stretch(n_vertices(), [&](Index first, Index last) {
    kernels_.turn(rotations_.quaternions().data(), memory_.data(), turned_.data(), first, last);
  });
}

/// The best X for these rotations and blends.
template <class Real>
void Detail<Real>::solve_for(std::span<const double> blend, double change) {
  const Stopwatch stopwatch(report_.solve_seconds);
  for (std::size_t v = 0; v < x_.size(); ++v) {
    target_[v] = turned_[3 * v] + blend[v] * turned_[3 * v + 1] + change * turned_[3 * v + 2];
    residual_[v] = operator_.scale[v] * (target_[v] - kx_[v]);
  }
  take_step();
}

/// The best X for these rotations, and the blend that the anchors support.
template <class Real>
Blend Detail<Real>::solve_for_blend() {
  const Stopwatch stopwatch(report_.solve_seconds);
  for (std::size_t v = 0; v < x_.size(); ++v) {
    const double scale = operator_.scale[v];
    residual_[3 * v] = scale * (turned_[3 * v] - kx_[v]);
    residual_[3 * v + 1] = scale * turned_[3 * v + 1];
    residual_[3 * v + 2] = scale * turned_[3 * v + 2];
  }
  std::ranges::fill(steps_, Vector3<double>{});
  solve(3, steps_);
  apply_operator(steps_, 3, k_step_);
  ResidualSums sums;
  double shape = 0;
  double change = 0;
  double counted = 0;
  for (std::size_t v = 0; v < x_.size(); ++v) {
    find_residuals(v, [&](const Residuals& residuals) { sums.add(residuals); });
    shape += counts_[v] * squared_norm(turned_[3 * v + 1]);
    change += counts_[v] * squared_norm(turned_[3 * v + 2]);
    counted += counts_[v];
  }
  sums.drop_rounding_errors(shape, change);
  const Blend found = global_blend(sums, counted * mean_edge_ * mean_edge_);
  for (std::size_t v = 0; v < x_.size(); ++v) {
    blend_fits_[v] = {};
    if (sums.s11 == 0) continue;
    find_residuals(v, [&](const Residuals& residuals) { blend_fits_[v].add(residuals, found.c); });
  }
  for (std::size_t v = 0; v < x_.size(); ++v) {
    x_[v] = x_[v] + steps_[3 * v] + found.b * steps_[3 * v + 1] + found.c * steps_[3 * v + 2];
    kx_[v] = kx_[v] + k_step_[3 * v] + found.b * k_step_[3 * v + 1] + found.c * k_step_[3 * v + 2];
  }
  report_.blend = found.b;
  return found;
}

/// Calls `visit` with what the steps leave of the shape at a vertex, and of its distance from where
/// it was observed.
template <class Real>
void Detail<Real>::find_residuals(std::size_t v, const auto& visit) const {
  if (counts_[v] == 0) return;
  visit(Residuals{kx_[v] + k_step_[3 * v] - turned_[3 * v], k_step_[3 * v + 1] - turned_[3 * v + 1],
                  k_step_[3 * v + 2] - turned_[3 * v + 2]});
  if (!noise_) return;
  visit(Residuals{x_[v] + steps_[3 * v] - observed_[v], steps_[3 * v + 1], steps_[3 * v + 2],
                  anchor_weights_[v]});
}

/// The errors of the shape per coordinate, sigma_L^2 = (E + lambda |q|^2) / (3 anchors) with E the
/// energy and q how far anchors moved, tell the weight of the next frame's anchors.
template <class Real>
void Detail<Real>::weigh_anchors() {
  double energy = 0;
  double anchors = 0;
  for (std::size_t v = 0; v < x_.size(); ++v) {
    energy += counts_[v] * squared_norm(kx_[v] - target_[v]);
    energy += anchor_weights_[v] * squared_norm(x_[v] - observed_[v]);
    anchors += is_anchor_[v];
  }
  const double found = energy / (3 * anchors * *noise_ * *noise_);
  if (!std::isfinite(found)) return;
  weight_ = (weight_ + std::clamp(found, least_weight, largest_weight)) / 2;
}

template class Detail<float>;
template class Detail<double>;

}  // namespace dynmesh
