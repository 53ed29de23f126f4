#include "detail/shape_fit.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <utility>

#include "support/conjugate_gradients.hpp"
#include "support/geometry.hpp"

namespace dynmesh {
ShapeFit::ShapeFit(const Cells& cells, Workers& workers, const TrainingConstants& constants,
                   bool is_change)
    : cells_(cells), workers_(workers), constants_(constants), is_change_(is_change) {}

void ShapeFit::reset(Modes modes) {
  std::vector<double> coefficients(modes.n_coefficients());
  if (modes.n_coefficients() > 0) {
    for (auto* values :
         {&gradient_, &direction_, &product_, &preconditioned_, &squares_, &penalties_, &shares_}) {
      values->resize(modes.n_coefficients());
    }
    for (auto* values : {&seen_, &averaged_}) values->resize(cells_.size());
    for (auto* fields : {&shape_, &wanted_, &steps_, &k_steps_, &residual_, &mode_shape_,
                         &mode_wanted_, &mode_steps_, &mode_k_steps_}) {
      fields->resize(cells_.size());
    }
  }
  // Nothing below can throw.
  std::ranges::fill(shape_, Vector3<double>{});
  modes_ = std::move(modes);
  coefficients_ = std::move(coefficients);
  begin();
}

/// Nothing is known about the coefficients yet.
void ShapeFit::begin() {
  residual_variance_ = -1;
  determined_ = static_cast<double>(modes_.size());
  size_ = constants_.first_variance * determined_;
}

void ShapeFit::replace(Modes& modes) {
  const bool is_first = !exists();
  std::swap(modes_, modes);
  if (is_first) begin();
}

std::size_t ShapeFit::memory_size() const {
  if (is_change_) return 3;  // the coefficients begin at 0 in each frame
  return 3 + static_cast<std::size_t>(modes_of_part * (constants_.local_parts + 1));
}

std::vector<double> ShapeFit::memory() const {
  std::vector<double> memory(memory_size());
  store(memory);
  return memory;
}

void ShapeFit::store(std::span<double> memory) const {
  memory[0] = residual_variance_;
  memory[1] = size_;
  memory[2] = determined_;
  if (!is_change_) std::ranges::copy(coefficients_, memory.begin() + 3);
}

bool ShapeFit::accepts(std::span<const double> memory) const {
  const auto is_finite = [](double value) { return std::isfinite(value); };
  return memory.size() == memory_size() && std::ranges::all_of(memory, is_finite) &&
         memory[1] >= 0 && memory[2] >= 0 && are_plausible(memory.subspan(3));
}

void ShapeFit::recall(std::span<const double> memory) {
  residual_variance_ = memory[0];
  size_ = memory[1];
  determined_ = memory[2];
  if (is_change_) return;
  std::ranges::copy(memory.subspan(3, coefficients_.size()), coefficients_.begin());
  if (exists()) modes_.combine(coefficients_, shape_, workers_);
}

/// h: the known mask, averaged over the cells.
void ShapeFit::weigh_seen(const Generations& generations) {
  const auto generation = generations.of_vertices();
  for (std::size_t v = 0; v < seen_.size(); ++v) {
    seen_[v] = generation[v] == Generations::anchor ? 1 : 0;
  }
  for (int n = 0; n < constants_.averagings; ++n) {
    for (std::size_t v = 0; v < seen_.size(); ++v) {
      const auto cell = cells_[static_cast<Index>(v)];
      double sum = seen_[v];
      for (const Index j : cell) sum += seen_[static_cast<std::size_t>(j)];
      averaged_[v] = sum / static_cast<double>(cell.size() + 1);
    }
    std::swap(seen_, averaged_);
  }
}

/// lambda_j, and the share of each coefficient that the anchors determine, g_j = d_j / (d_j +
/// lambda_j).
void ShapeFit::penalize(double ratio) {
  for (std::size_t j = 0; j < penalties_.size(); ++j) {
    const bool is_global = j < static_cast<std::size_t>(modes_of_part);
    penalties_[j] = (is_global ? constants_.caution_of_global_part : constants_.caution) * ratio;
    const double share = squares_[j] / (squares_[j] + penalties_[j]);
    shares_[j] = std::isfinite(share) ? share : 0;  // in single precision, squares can overflow
  }
}

/// Solves for the steps towards a shape, without those of noisy anchors to their positions.
void ShapeFit::step_towards(Field wanted, const Anchors& anchors, ShapeSystem& system,
                            std::vector<Vector3<double>>& steps,
                            std::vector<Vector3<double>>& k_steps) {
  const Field found = system.template solve<1>(
      [&](std::size_t v, std::size_t) { return wanted[v]; }, anchors.observed, anchors);
  std::ranges::copy(found, steps.begin());
  system.apply(steps, 1, k_steps);
}

/// Sets the residual of the shape and returns the energies, with the terms of noisy anchors.
ShapeFit::Energies ShapeFit::measure(const ResidualField& residuals) {
  Energies energies;
  const Anchors& anchors = residuals.anchors;
  for (std::size_t v = 0; v < residuals.size(); ++v) {
    residual_[v] = {};
    if (anchors.counts[v] == 0) continue;
    const Vector3<double> r3 = k_steps_[v] - wanted_[v];
    bool is_shape = true;
    residuals.visit(v, [&](const Residuals& r) {
      const Vector3<double> without = is_change_ ? r.r0 : r.r0 + r.r1;
      const Vector3<double> with = without + (is_shape ? r3 : steps_[v]);
      if (is_shape) residual_[v] = with;
      energies.without += r.weight * squared_norm(without);
      energies.with += r.weight * squared_norm(with);
      is_shape = false;
    });
  }
  return energies;
}

/// What a coefficient is, as far as is known before the frame: 0 if the anchors determine it, so
/// that the fit is no larger than they demand, and otherwise what it was, so that a limb that is
/// hidden keeps its shape.
double ShapeFit::expected(std::size_t j) const {
  const double largest = constants_.largest_kept;
  return std::clamp((1 - shares_[j]) * coefficients_[j], -largest, largest);
}

/// Minimises |r0 + r1 + r3 + F(B d)|^2 + sum_j lambda_j (a_j + d_j - e_j)^2 over d, e being what is
/// expected, by preconditioned conjugate gradients. F(f) = K Y - Q f with the steps Y towards Q f.
/// Adds d to a.
double ShapeFit::descend(const Anchors& anchors, ShapeSystem& system, const Rotations& rotations) {
  std::vector<double>& a = coefficients_;
  // The gradient, downhill: B^T Q^T r, which it is before, - lambda (a - e).
  for (std::size_t j = 0; j < a.size(); ++j) {
    gradient_[j] -= penalties_[j] * (a[j] - expected(j));
  }
  const auto precondition = [&] {
    for (std::size_t j = 0; j < a.size(); ++j) {
      preconditioned_[j] = gradient_[j] / (squares_[j] + penalties_[j]);
    }
  };
  // S p = -B^T Q^T F(B p) + lambda p, lambda by coefficient
  const auto multiply = [&] {
    modes_.combine(direction_, mode_shape_, workers_);
    rotations.turn(mode_shape_, mode_wanted_);
    step_towards(mode_wanted_, anchors, system, mode_steps_, mode_k_steps_);
    for (std::size_t v = 0; v < mode_shape_.size(); ++v) {
      residual_[v] = anchors.counts[v] * (mode_wanted_[v] - mode_k_steps_[v]);  // -F
    }
    rotations.turn_back(residual_, mode_shape_);
    modes_.project(mode_shape_, product_, workers_);
    for (std::size_t j = 0; j < a.size(); ++j) product_[j] += penalties_[j] * direction_[j];
  };
  const auto advance = [&](const std::array<double, 1>& lengths) {
    const double length = lengths[0];
    for (std::size_t j = 0; j < a.size(); ++j) a[j] += length * direction_[j];
    for (std::size_t v = 0; v < steps_.size(); ++v) {
      steps_[v] = steps_[v] + length * mode_steps_[v];
      k_steps_[v] = k_steps_[v] + length * mode_k_steps_[v];
      wanted_[v] = wanted_[v] + length * mode_wanted_[v];
    }
  };
  const ConjugateVectors<double> vectors = {gradient_, preconditioned_, direction_, product_};
  return conjugate_gradients<1>(vectors, constants_.steps, constants_.settled, precondition,
                                multiply, advance)[0];
}

bool ShapeFit::are_plausible(std::span<const double> coefficients) const {
  const double largest = constants_.largest_coefficient;
  return std::ranges::all_of(coefficients, [&](double a) { return std::abs(a) <= largest; });
}

/// Returns to the rest shape.
void ShapeFit::forget() {
  std::ranges::fill(coefficients_, 0.0);
  for (auto* fields : {&steps_, &k_steps_, &wanted_}) std::ranges::fill(*fields, Vector3<double>{});
}

/// The variance of the coefficients, v = N_v / D_v, from those that the frames determine. What is
/// kept without being determined says nothing about the training sequence.
void ShapeFit::update_evidence() {
  double determined = 0;
  double size = 0;
  for (std::size_t j = 0; j < shares_.size(); ++j) {
    determined += shares_[j];
    size += shares_[j] * coefficients_[j] * coefficients_[j];
  }
  size_ = (size_ + size) / 2;
  determined_ = (determined_ + std::max(constants_.least_determined, determined)) / 2;
}

/// v
double ShapeFit::variance() const {
  const double found = determined_ > 0 ? size_ / determined_ : constants_.first_variance;
  const double largest =
      is_change_ ? constants_.largest_variance_of_change : constants_.largest_variance;
  return std::clamp(found, constants_.least_variance, largest);
}

ShapeFit::Found ShapeFit::find(const ResidualField& residuals, ShapeSystem& system,
                               const Rotations& rotations, const Generations& generations) {
  const Anchors& anchors = residuals.anchors;
  Found found;
  found.is_first = residual_variance_ < 0;
  if (is_change_) {
    forget();
    std::ranges::fill(shape_, Vector3<double>{});
  } else {
    rotations.turn(shape_, wanted_);
    step_towards(wanted_, anchors, system, steps_, k_steps_);
  }
  Energies energies = measure(residuals);
  const double coordinates = 3 * static_cast<double>(anchors.number);
  const double residual_variance =
      found.is_first ? energies.with / coordinates : residual_variance_;
  const double ratio = residual_variance / variance();
  // Rounding errors say nothing about the coefficients, nor about how well the modes fit.
  const double rounding =
      residuals.rounding * std::accumulate(anchors.counts.begin(), anchors.counts.end(), 0.0);
  const bool is_at_rest = energies.with <= rounding;
  if (!is_at_rest && ratio > 0 && std::isfinite(ratio)) {
    weigh_seen(generations);
    rotations.turn_back(residual_, mode_shape_);
    modes_.project_and_weigh(mode_shape_, seen_, gradient_, squares_, workers_);
    penalize(ratio);
    if (descend(anchors, system, rotations) > 0) {
      if (!are_plausible(coefficients_)) forget();
      modes_.combine(coefficients_, shape_, workers_);
      energies.with = measure(residuals).with;
    }
    update_evidence();
  }
  if (!is_at_rest && std::isfinite(energies.with)) residual_variance_ = energies.with / coordinates;
  found.prior_weight =
      is_change_ ? 1 : std::clamp(variance() / constants_.first_variance - 1, 0.0, 1.0);
  const double explained = 1 - energies.with / energies.without;
  if (energies.without > rounding && std::isfinite(explained))
    found.prior_share = std::clamp(explained, 0.0, 1.0);
  found.steps = steps_;
  found.k_steps = k_steps_;
  found.wanted = wanted_;
  return found;
}

}  // namespace dynmesh
