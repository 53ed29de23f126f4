#include "shape/shape_fit.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

#include "base/geometry.hpp"
#include "linear/conjugate_gradients.hpp"
#include "shape/constants.hpp"

namespace dynmesh {
ShapeFit::ShapeFit(Of of, const Cells& cells, Workers& workers, double largest_kept,
                   const Modes& modes)
    : of_(of),
      largest_kept_(largest_kept),
      cells_(cells),
      workers_(workers),
      modes_(modes),
      sums_(modes.parts().size(), modes.n_coefficients()) {
  const std::size_t n = modes_.n_coefficients();
  if (n == 0) return;
  for (auto* values : {&a_, &gradient_, &direction_, &product_, &preconditioned_, &squares_,
                       &penalties_, &shares_}) {
    values->resize(n);
  }
  for (auto* values : {&seen_, &averaged_}) values->resize(cells.size());
  for (AddedShape* added : {&added_, &direction_added_}) added->set_zero(cells.size());
  left_.resize(cells.size());
}

Field ShapeFit::shape_of(const FitMemory& memory) {
  const auto a = std::span(memory.coefficients).first(a_.size());
  if (!std::ranges::equal(a, a_)) {
    std::ranges::copy(a, a_.begin());
    modes_.combine(a_, added_.shape, sums_, workers_);
  }
  return added_.shape;
}

void ShapeFit::set_zero() {
  std::ranges::fill(a_, 0.0);
  added_.set_zero(cells_.size());
}

/// Finds the steps towards a shape, without those of noisy anchors to their positions.
void ShapeFit::step_towards(AddedShape& added, const Anchors& anchors, ShapeSystem& system,
                            std::span<const Quaternion> q) {
  turn(q, added.shape, added.wanted, workers_);
  system.solve<1>([&](std::size_t v, std::size_t) { return added.wanted[v]; }, anchors.observed,
                  anchors, added.steps);
  system.apply(added.steps, 1, added.k_steps);
}

/// h: the known mask, averaged over the cells.
void ShapeFit::weigh_seen(const Anchors& anchors) {
  for (std::size_t v = 0; v < seen_.size(); ++v) seen_[v] = anchors.is_anchor(v) ? 1 : 0;
  for (int n = 0; n < training_constants.averagings; ++n) {
    for (std::size_t v = 0; v < seen_.size(); ++v) {
      double sum = seen_[v];
      for (const Index j : cells_[v]) sum += seen_[j];
      averaged_[v] = sum / static_cast<double>(cells_[v].size() + 1);
    }
    std::swap(seen_, averaged_);
  }
}

/// lambda_j, and the share of each coefficient that the anchors determine, g_j = d_j / (d_j +
/// lambda_j).
void ShapeFit::penalize(double ratio) {
  for (std::size_t j = 0; j < penalties_.size(); ++j) {
    const bool is_global = j < static_cast<std::size_t>(modes_of_part);
    penalties_[j] = (is_global ? 1 : training_constants.caution) * ratio;
    const double share = squares_[j] / (squares_[j] + penalties_[j]);
    shares_[j] = std::isfinite(share) ? share : 0;  // in single precision, squares can overflow
  }
}

/// Sets the residual of the shape and returns the energies, with the terms of noisy anchors.
ShapeFit::Energies ShapeFit::measure(const ResidualField& residuals) {
  Energies energies;
  const Anchors& anchors = residuals.anchors;
  for (std::size_t v = 0; v < residuals.size(); ++v) {
    left_[v] = {};
    if (anchors.counts[v] == 0) continue;
    const Vector3 r3 = added_.k_steps[v] - added_.wanted[v];
    bool is_shape = true;
    residuals.visit(v, [&](const Residuals& r) {
      const Vector3 without = of_ == Of::rest ? r.r0 + r.r1 : r.r0;
      const Vector3 with = without + (is_shape ? r3 : added_.steps[v]);
      if (is_shape) left_[v] = with;
      energies.without += r.weight * squared_norm(without);
      energies.with += r.weight * squared_norm(with);
      is_shape = false;
    });
  }
  return energies;
}

/// Minimises |r + r3 + F(B d)|^2 + sum_j lambda_j (a_j + d_j - e_j)^2 over d, e being what is
/// expected, by preconditioned conjugate gradients. F(f) = K Y - Q f with the steps Y towards Q f.
/// Adds d to a.
double ShapeFit::descend(const Anchors& anchors, ShapeSystem& system,
                         std::span<const Quaternion> q) {
  AddedShape& along = direction_added_;
  // The gradient, downhill: B^T Q^T r, which it is before, - lambda (a - e). A coefficient is
  // expected to be 0 if the anchors determine it, so that the fit is no larger than they demand,
  // and otherwise what it was, so that a limb that is hidden keeps its shape.
  for (std::size_t j = 0; j < a_.size(); ++j) {
    const double expected = std::clamp((1 - shares_[j]) * a_[j], -largest_kept_, largest_kept_);
    gradient_[j] -= penalties_[j] * (a_[j] - expected);
  }
  const auto precondition = [&] {
    for (std::size_t j = 0; j < a_.size(); ++j) {
      preconditioned_[j] = gradient_[j] / (squares_[j] + penalties_[j]);
    }
  };
  // S p = -B^T Q^T F(B p) + lambda p, lambda by coefficient
  const auto multiply = [&] {
    modes_.combine(direction_, along.shape, sums_, workers_);
    step_towards(along, anchors, system, q);
    for (std::size_t v = 0; v < left_.size(); ++v) {
      left_[v] = anchors.counts[v] * (along.wanted[v] - along.k_steps[v]);  // -F
    }
    turn_back(q, left_, left_, workers_);
    modes_.project(left_, product_, {}, {}, sums_, workers_);
    for (std::size_t j = 0; j < a_.size(); ++j) product_[j] += penalties_[j] * direction_[j];
  };
  const auto advance = [&](const std::array<double, 1>& lengths) {
    const double length = lengths[0];
    for (std::size_t j = 0; j < a_.size(); ++j) a_[j] += length * direction_[j];
    for (std::size_t v = 0; v < left_.size(); ++v) {
      added_.steps[v] = added_.steps[v] + length * along.steps[v];
      added_.k_steps[v] = added_.k_steps[v] + length * along.k_steps[v];
      added_.wanted[v] = added_.wanted[v] + length * along.wanted[v];
    }
  };
  const ConjugateVectors<double> vectors = {gradient_, preconditioned_, direction_, product_};
  return conjugate_gradients<1>(vectors, training_constants.steps, 0, precondition, multiply,
                                advance, workers_)[0];
}

/// The variance of the coefficients, v = N_v / D_v, from those that the frames determine. What is
/// kept without being determined says nothing about the training sequence.
void ShapeFit::update_evidence(FitMemory& memory) const {
  double determined = 0;
  double size = 0;
  for (std::size_t j = 0; j < shares_.size(); ++j) {
    determined += shares_[j];
    size += shares_[j] * a_[j] * a_[j];
  }
  memory.size = (memory.size + size) / 2;
  memory.determined = (memory.determined + determined) / 2;
}

/// v
double ShapeFit::variance(const FitMemory& memory) const {
  const double found = memory.determined > 0 ? memory.size / memory.determined : 0;
  const double least = training_constants.least_variance;
  return std::clamp(found, least, of_ == Of::rest ? training_constants.largest_variance : least);
}

/// k
double ShapeFit::prior_weight(const FitMemory& memory, const Anchors& anchors) const {
  if (of_ == Of::change) return 1;
  const auto beyond = [](double x, double least) { return std::clamp(x / least - 1, 0.0, 1.0); };
  double weight = beyond(variance(memory), training_constants.least_variance);
  if (!anchors.are_noisy()) weight *= beyond(memory.explained, training_constants.least_share);
  // None of the n training frames has a coefficient whose square exceeds n. Poses far beyond them
  // say nothing about what they do not show.
  const double mean_square = memory.determined > 0 ? memory.size / memory.determined : 0;
  return weight * std::clamp(2 - mean_square / static_cast<double>(modes_.n_frames()), 0.0, 1.0);
}

void ShapeFit::find(const ResidualField& residuals, ShapeSystem& system,
                    std::span<const Quaternion> q, FitMemory& memory) {
  if (memory.determined == 0) {  // nothing is known about the coefficients yet
    memory.residual_variance = -1;
    memory.determined = static_cast<double>(modes_.size());
    memory.size = training_constants.least_variance * memory.determined;
    memory.explained = 2 * training_constants.least_share;
  }
  const Anchors& anchors = residuals.anchors;
  if (of_ == Of::rest) {
    shape_of(memory);
    step_towards(added_, anchors, system, q);
  } else {
    set_zero();
  }
  Energies energies = measure(residuals);
  const double coordinates = 3 * static_cast<double>(anchors.number);
  const double residual_variance =
      memory.residual_variance < 0 ? energies.with / coordinates : memory.residual_variance;
  const double ratio = residual_variance / variance(memory);
  // Rounding errors say nothing about the coefficients, nor about how well the modes fit.
  const double rounding =
      residuals.rounding * std::accumulate(anchors.counts.begin(), anchors.counts.end(), 0.0);
  const bool is_at_rest = energies.with <= rounding;
  if (!is_at_rest && ratio > 0 && std::isfinite(ratio)) {
    weigh_seen(anchors);
    turn_back(q, left_, left_, workers_);
    modes_.project(left_, gradient_, seen_, squares_, sums_, workers_);
    penalize(ratio);
    if (descend(anchors, system, q) > 0) {
      const double largest = training_constants.largest_coefficient;
      const auto is_plausible = [&](double a) { return std::abs(a) <= largest; };
      if (!std::ranges::all_of(a_, is_plausible)) set_zero();
      modes_.combine(a_, added_.shape, sums_, workers_);
      energies.with = measure(residuals).with;
    }
    update_evidence(memory);
  }
  if (of_ == Of::rest) std::ranges::copy(a_, memory.coefficients.begin());
  const double explained = std::clamp(1 - energies.with / energies.without, 0.0, 1.0);
  const bool is_share = energies.without > rounding && std::isfinite(explained);
  if (is_share) {
    const double kept = training_constants.share_kept;
    memory.explained = kept * memory.explained + (1 - kept) * explained;
  }
  if (!is_at_rest && std::isfinite(energies.with)) {
    memory.residual_variance = energies.with / coordinates;
  }
  memory.prior_weight = prior_weight(memory, anchors);
  memory.prior_share = is_share ? explained : 0;
}

}  // namespace dynmesh
