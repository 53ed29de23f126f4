#include "surface_fit/surface_system.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <utility>

#include "base/geometry.hpp"
#include "linear/conjugate_gradients.hpp"

namespace dynmesh {
SurfaceSystem::SurfaceSystem(const ShapeModel& model, const std::vector<double>& membrane,
                             const SparseMatrix& normal, const TrackingConstants& constants,
                             std::span<const Tie> ties, Workers& workers)
    : operator_(model.k),
      membrane_(membrane),
      constants_(constants),
      workers_(workers),
      coarse_(model.topology.cells, model.first_frame, model.clusters(), normal, ties),
      factors_(MaskedFactor(std::make_shared<const FactorPlan>(normal, model.plan->elimination),
                            workers)),
      scaled_(model.size()) {}

/// (k,) the weights that hold the vertices.
std::vector<double> SurfaceSystem::held(std::span<const Landmark> landmarks) const {
  std::vector<double> weights;
  for (const double mu : membrane_) weights.push_back(constants_.hold * mu);
  for (const Landmark& landmark : landmarks) weights[landmark.vertex] += landmark.weight;
  return weights;
}

Lent<MaskedFactor> SurfaceSystem::preconditioner(const Pulls& pulls, double factor) {
  const auto weights = held(pulls.landmarks);
  std::vector<double> diagonal = weights;
  for (const SurfaceRow& row : pulls.rows) {
    const double weight = constants_.preconditioned * factor * row.weight;
    for (std::size_t s = 0; s < 3; ++s) diagonal[row.corners[s]] += weight * row.shares[s];
  }
  for (const Tie& tie : pulls.ties) {
    diagonal[tie.i] += tie.weight;
    diagonal[tie.j] += tie.weight;
  }
  Lent<MaskedFactor> found = factors_.lend();
  found.factorize(std::vector<std::uint8_t>(diagonal.size(), 1), diagonal);
  found.round();
  coarse_.factorize(pulls.rows, factor, weights, pulls.ties);
  return found;
}

void SurfaceSystem::pull_back(std::span<const double> resistance, Field detail,
                              std::span<Vector3> forces) {
  workers_.for_each_in_chunks(operator_.size(), [&](std::size_t v) {
    scaled_[v] = resistance[v] * operator_.scale[v] * detail[v];
  });
  multiply_by_c(operator_, scaled_, forces, workers_);
}

/// product = (K^T W K + mu C) x.
void SurfaceSystem::multiply(std::span<const double> resistance, Field x,
                             std::span<Vector3> product) {
  apply_operator(operator_, x, 1, scaled_, workers_);
  workers_.for_each_in_chunks(operator_.size(), [&](std::size_t v) {
    scaled_[v] = resistance[v] * operator_.scale[v] * scaled_[v] + membrane_[v] * x[v];
  });
  multiply_by_c(operator_, scaled_, product, workers_);
}

/// x = the inverse of the factored matrix times the right side, in single precision, which suffices
/// for a preconditioner.
void SurfaceSystem::apply_factor(MaskedFactor& factor, Field right_side, std::span<Vector3> x) {
  constexpr std::size_t quad = 4;
  const auto order = factor.order();
  double largest = 0;  // to which all is relative, as its range is smaller than that of positions
  for (const Vector3& f : right_side) {
    largest = std::max({largest, std::abs(f.x), std::abs(f.y), std::abs(f.z)});
  }
  const double scale = largest > std::numeric_limits<double>::min() ? 1 / largest : 0;
  rounded_.resize(quad * order.size());
  workers_.for_each_in_chunks(order.size(), [&](std::size_t r) {
    const auto scaled = scale * right_side[at(order[r])];
    const std::array<double, quad> numbers = {scaled.x, scaled.y, scaled.z};
    std::ranges::transform(numbers, &rounded_[quad * r],
                           [](double n) { return static_cast<float>(n); });
  });
  factor.solve_rounded(rounded_);
  workers_.for_each_in_chunks(order.size(), [&](std::size_t r) {
    const float* solution = &rounded_[quad * r];
    x[at(order[r])] = largest * Vector3{solution[0], solution[1], solution[2]};
  });
}

void SurfaceSystem::solve(const Pulls& pulls, MaskedFactor& preconditioner,
                          std::span<const double> resistance, const SolverLimits& limits,
                          std::span<Vector3> x, std::span<Vector3> force) {
  const auto weights = held(pulls.landmarks);
  RowProduct row_product(pulls.rows, x.size(), workers_);
  row_product.add_forces(x, force);
  for (const Landmark& l : pulls.landmarks) {
    force[l.vertex] = force[l.vertex] + l.weight * (l.target - x[l.vertex]);
  }
  std::vector<Vector3> steps(x.size()), direction(x.size()), product(x.size());
  const auto precondition = [&] {
    apply_factor(preconditioner, force, product);
    coarse_.add(force, product, workers_);
  };
  const auto multiply_direction = [&] {
    multiply(resistance, direction, product);
    for (const Tie& tie : pulls.ties) {
      const auto tied = tie.weight * (direction[tie.i] - direction[tie.j]);
      product[tie.i] = product[tie.i] + tied;
      product[tie.j] = product[tie.j] - tied;
    }
    row_product.add(direction, product);
    workers_.for_each_in_chunks(product.size(), [&](std::size_t v) {
      product[v] = product[v] + weights[v] * direction[v];
    });
  };
  const auto advance = [&](const std::array<double, 1>& length) {
    workers_.for_each_in_chunks(
        steps.size(), [&](std::size_t v) { steps[v] = steps[v] + length[0] * direction[v]; });
  };
  const ConjugateVectors<Vector3> vectors = {force, product, direction, product};
  conjugate_gradients<1>(vectors, limits.steps, limits.settled, precondition, multiply_direction,
                         advance, workers_);
  for (std::size_t v = 0; v < x.size(); ++v) x[v] = x[v] + steps[v];
}

}  // namespace dynmesh
