#include "surface_fit/surface_system.hpp"

#include <algorithm>
#include <array>
#include <utility>

#include "base/geometry.hpp"
#include "linear/conjugate_gradients.hpp"

namespace dynmesh {
SurfaceSystem::SurfaceSystem(ShapeSystem& shape, const ShapeModel& model,
                             const TrackingConstants& constants, std::span<const Tie> ties,
                             Workers& workers)
    : shape_(shape),
      constants_(constants),
      workers_(workers),
      ties_(ties),
      coarse_(model.topology.cells, model.first_frame, model.clusters(),
              normal_matrix(model.k, shape.membrane()), ties_),
      anchors_(model.size(), true) {
  std::ranges::fill(anchors_.is_solved, std::uint8_t{1});
  anchors_.n_solved = model.size();
}

/// (k,) the weights that hold the vertices.
std::vector<double> SurfaceSystem::held(std::span<const Landmark> landmarks) const {
  std::vector<double> weights;
  for (const double mu : shape_.membrane()) weights.push_back(constants_.hold * mu);
  for (const Landmark& landmark : landmarks) weights[landmark.vertex] += landmark.weight;
  return weights;
}

void SurfaceSystem::factorize(std::span<const SurfaceRow> rows, std::span<const Landmark> landmarks,
                              double factor) {
  const auto weights = held(landmarks);
  std::ranges::copy(weights, anchors_.weights.begin());
  for (const SurfaceRow& row : rows) {
    const double weight = constants_.preconditioned * factor * row.weight;
    for (std::size_t s = 0; s < 3; ++s) anchors_.weights[row.corners[s]] += weight * row.shares[s];
  }
  for (const Tie& tie : ties_) {
    anchors_.weights[tie.i] += tie.weight;
    anchors_.weights[tie.j] += tie.weight;
  }
  shape_.factorize(anchors_);
  coarse_.factorize(rows, factor, weights, ties_);
}

void SurfaceSystem::solve(std::span<const SurfaceRow> rows, std::span<const Landmark> landmarks,
                          double settled, std::span<Vector3> x, std::span<Vector3> force) {
  const auto weights = held(landmarks);
  RowProduct row_product(rows, x.size(), workers_);
  row_product.add_forces(x, force);
  for (const Landmark& l : landmarks) {
    force[l.vertex] = force[l.vertex] + l.weight * (l.target - x[l.vertex]);
  }
  std::vector<Vector3> steps(x.size()), direction(x.size()), product(x.size());
  const auto precondition = [&] {
    shape_.precondition(force, product);
    coarse_.add(force, product, workers_);
  };
  const auto multiply_direction = [&] {
    shape_.multiply(direction, product);
    for (const Tie& tie : ties_) {
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
  conjugate_gradients<1>(vectors, constants_.steps, settled, precondition, multiply_direction,
                         advance, workers_);
  for (std::size_t v = 0; v < x.size(); ++v) x[v] = x[v] + steps[v];
}

}  // namespace dynmesh
