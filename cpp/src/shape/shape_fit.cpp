#include "shape/shape_fit.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

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
      size_(modes.n_coefficients() > 0 ? cells.size() : 0),
      sums_(modes.parts().size(), modes.n_coefficients()),
      coefficients_(Coefficients(modes.n_coefficients()), 1),
      shapes_(AddedShape(size_), 2),
      fields_(std::vector<Vector3>(size_), 1),
      numbers_(std::vector<double>(size_), 2) {}

void ShapeFit::combine(const FitMemory& memory, std::span<Vector3> shape) {
  modes_.combine(std::span(memory.coefficients).first(modes_.n_coefficients()), shape, sums_,
                 workers_);
}

LentField ShapeFit::shape_of(const FitMemory& memory) {
  LentField shape = fields_.lend();
  combine(memory, shape);
  return shape;
}

/// Finds the steps towards a shape, without those of noisy anchors to their positions.
void ShapeFit::step_towards(AddedShape& added, ShapeFactor& factor, ShapeSystem& system,
                            std::span<const Quaternion> q) {
  turn(q, added.shape, added.wanted, workers_);
  system.solve<1>([&](std::size_t v, std::size_t) { return added.wanted[v]; },
                  factor.anchors.observed, factor, added.steps);
  system.apply(added.steps, 1, added.k_steps);
}

/// h: the known mask, averaged over the cells.
Lent<std::vector<double>> ShapeFit::seen_around(const Anchors& anchors) {
  auto seen = numbers_.lend();
  auto averaged = numbers_.lend();
  for (std::size_t v = 0; v < seen.size(); ++v) seen[v] = anchors.is_anchor(v) ? 1 : 0;
  for (int n = 0; n < training_constants.averagings; ++n) {
    for (std::size_t v = 0; v < seen.size(); ++v) {
      double sum = seen[v];
      for (const Index j : cells_[v]) sum += seen[j];
      averaged[v] = sum / static_cast<double>(cells_[v].size() + 1);
    }
    std::swap(seen, averaged);
  }
  return seen;
}

/// lambda_j, and the share of each coefficient that the anchors determine, g_j = d_j / (d_j +
/// lambda_j).
void ShapeFit::penalize(double ratio, Coefficients& of) {
  for (std::size_t j = 0; j < of.penalties.size(); ++j) {
    const bool is_global = j < static_cast<std::size_t>(modes_of_part);
    of.penalties[j] = (is_global ? 1 : training_constants.caution) * ratio;
    const double share = of.squares[j] / (of.squares[j] + of.penalties[j]);
    of.shares[j] = std::isfinite(share) ? share : 0;  // in single precision, squares can overflow
  }
}

/// The energies, with the terms of noisy anchors, and what is left of the residual of the shape,
/// r + r3, 0 where vertices do not count.
ShapeFit::Energies ShapeFit::measure(const ResidualField& residuals, const AddedShape& added,
                                     std::span<Vector3> left) const {
  Energies energies;
  const Anchors& anchors = residuals.anchors;
  for (std::size_t v = 0; v < residuals.size(); ++v) {
    left[v] = {};
    if (anchors.counts[v] == 0) continue;
    const Vector3 r3 = added.k_steps[v] - added.wanted[v];
    bool is_shape = true;
    residuals.visit(v, [&](const Residuals& r) {
      const Vector3 without = of_ == Of::rest ? r.r0 + r.r1 : r.r0;
      const Vector3 with = without + (is_shape ? r3 : added.steps[v]);
      if (is_shape) left[v] = with;
      energies.without += r.weight * squared_norm(without);
      energies.with += r.weight * squared_norm(with);
      is_shape = false;
    });
  }
  return energies;
}

/// Minimises (14) over d, e being what is expected, by preconditioned conjugate gradients, and adds
/// d to a. F(f) = K Y - Q f with the steps Y towards Q f.
double ShapeFit::descend(ShapeFactor& factor, ShapeSystem& system, std::span<const Quaternion> q,
                         std::span<Vector3> left, Coefficients& of, AddedShape& added) {
  Lent<AddedShape> along = shapes_.lend();
  // The of.gradient, downhill: B^T Q^T r, which it is before, - lambda (a - e). A coefficient is
  // expected to be 0 if the anchors determine it, so that the fit is no larger than they demand,
  // and otherwise what it was, so that a limb that is hidden keeps its shape.
  for (std::size_t j = 0; j < of.a.size(); ++j) {
    const double expected = std::clamp((1 - of.shares[j]) * of.a[j], -largest_kept_, largest_kept_);
    of.gradient[j] -= of.penalties[j] * (of.a[j] - expected);
  }
  const auto precondition = [&] {
    for (std::size_t j = 0; j < of.a.size(); ++j) {
      of.preconditioned[j] = of.gradient[j] / (of.squares[j] + of.penalties[j]);
    }
  };
  // S p = -B^T Q^T F(B p) + lambda p, lambda by coefficient
  const auto multiply = [&] {
    modes_.combine(of.direction, along.shape, sums_, workers_);
    step_towards(along, factor, system, q);
    for (std::size_t v = 0; v < left.size(); ++v) {
      left[v] = factor.anchors.counts[v] * (along.wanted[v] - along.k_steps[v]);  // -F
    }
    turn_back(q, left, left, workers_);
    modes_.project(left, of.product, {}, {}, sums_, workers_);
    for (std::size_t j = 0; j < of.a.size(); ++j)
      of.product[j] += of.penalties[j] * of.direction[j];
  };
  const auto advance = [&](const std::array<double, 1>& lengths) {
    const double length = lengths[0];
    for (std::size_t j = 0; j < of.a.size(); ++j) of.a[j] += length * of.direction[j];
    for (std::size_t v = 0; v < left.size(); ++v) {
      added.steps[v] = added.steps[v] + length * along.steps[v];
      added.k_steps[v] = added.k_steps[v] + length * along.k_steps[v];
      added.wanted[v] = added.wanted[v] + length * along.wanted[v];
    }
  };
  const ConjugateVectors<double> vectors = {of.gradient, of.preconditioned, of.direction,
                                            of.product};
  return conjugate_gradients<1>(vectors, training_constants.steps, 0, precondition, multiply,
                                advance, workers_)[0];
}

/// The variance of the coefficients, v = N_v / D_v, from those that the frames determine. What is
/// kept without being determined says nothing about the training sequence.
void ShapeFit::update_evidence(const Coefficients& of, FitMemory& memory) {
  double determined = 0;
  double size = 0;
  for (std::size_t j = 0; j < of.shares.size(); ++j) {
    determined += of.shares[j];
    size += of.shares[j] * of.a[j] * of.a[j];
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

Lent<AddedShape> ShapeFit::find(const ResidualField& residuals, ShapeFactor& factor,
                                ShapeSystem& system, std::span<const Quaternion> q,
                                FitMemory& memory) {
  Lent<AddedShape> added = shapes_.lend();
  added.weight = 0;
  if (!exists()) return added;
  if (memory.determined == 0) {  // nothing is known about the coefficients yet
    memory.residual_variance = -1;
    memory.determined = static_cast<double>(modes_.size());
    memory.size = training_constants.least_variance * memory.determined;
    memory.explained = 2 * training_constants.least_share;
  }
  Lent<Coefficients> of = coefficients_.lend();
  const Anchors& anchors = residuals.anchors;
  if (of_ == Of::rest) {
    std::ranges::copy(std::span(memory.coefficients).first(of.a.size()), of.a.begin());
    combine(memory, added.shape);
    step_towards(added, factor, system, q);
  } else {
    std::ranges::fill(of.a, 0.0);
    added.set_zero();
  }
  LentField left = fields_.lend();
  Energies energies = measure(residuals, added, left);
  const double coordinates = 3 * static_cast<double>(anchors.number);
  const double residual_variance =
      memory.residual_variance < 0 ? energies.with / coordinates : memory.residual_variance;
  const double ratio = residual_variance / variance(memory);
  // Rounding errors say nothing about the coefficients, nor about how well the modes fit.
  const double rounding =
      residuals.rounding * std::accumulate(anchors.counts.begin(), anchors.counts.end(), 0.0);
  const bool is_at_rest = energies.with <= rounding;
  if (!is_at_rest && ratio > 0 && std::isfinite(ratio)) {
    turn_back(q, left, left, workers_);
    modes_.project(left, of.gradient, seen_around(anchors), of.squares, sums_, workers_);
    penalize(ratio, of);
    if (descend(factor, system, q, left, of, added) > 0) {
      const double largest = training_constants.largest_coefficient;
      const auto is_plausible = [&](double a) { return std::abs(a) <= largest; };
      if (!std::ranges::all_of(of.a, is_plausible)) {
        std::ranges::fill(of.a, 0.0);
        added.set_zero();
      }
      modes_.combine(of.a, added.shape, sums_, workers_);
      energies.with = measure(residuals, added, left).with;
    }
    update_evidence(of, memory);
  }
  if (of_ == Of::rest) std::ranges::copy(of.a, memory.coefficients.begin());
  const double explained = std::clamp(1 - energies.with / energies.without, 0.0, 1.0);
  const bool is_share = energies.without > rounding && std::isfinite(explained);
  if (is_share) {
    const double kept = training_constants.share_kept;
    memory.explained = kept * memory.explained + (1 - kept) * explained;
  }
  if (!is_at_rest && std::isfinite(energies.with)) {
    memory.residual_variance = energies.with / coordinates;
  }
  added.weight = memory.prior_weight = prior_weight(memory, anchors);
  memory.prior_share = is_share ? explained : 0;
  return added;
}

}  // namespace dynmesh
