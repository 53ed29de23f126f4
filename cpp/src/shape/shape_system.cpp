#include "shape/shape_system.hpp"

#include <algorithm>
#include <array>

#include "linear/conjugate_gradients.hpp"

namespace dynmesh {

ShapeSystem::ShapeSystem(const DetailOperator& k, Workers& workers)
    : operator_(k), workers_(workers), scaled_residual_(3 * k.size()), solution_(3 * k.size()) {}

void ShapeSystem::apply(Field x, int fields, std::span<Vector3> detail) const {
  apply_operator(operator_, x, fields, detail, workers_);
}

/// Sets the solution to K^T of the residual at these vertices.
void ShapeSystem::multiply_transposed(std::span<const Index> rows, int fields) {
  OperatorData c = data_of(operator_);
  c.scale = nullptr;
  workers_.for_each_short_chunk(static_cast<Index>(rows.size()), [&](Index first, Index last) {
    best_kernels().rotations.multiply(c, scaled_residual_.data(), fields, rows.data(),
                                      solution_.data(), first, last);
  });
}

/// Brings rows in this order into that of vertices; those that are not solved for are 0.
void ShapeSystem::scatter(Field rows, std::span<const Index> order, std::size_t width,
                          std::span<Vector3> x) const {
  if (order.size() < operator_.size()) std::ranges::fill(x, Vector3{});
  workers_.for_each_in_chunks(order.size(), [&](std::size_t r) {
    for (std::size_t f = 0; f < width; ++f) x[width * at(order[r]) + f] = rows[width * r + f];
  });
}

// Planes tie the three coordinates together, so that the system has 3 k unknowns and is not
// factored. N + weights, which has k, bounds it from above and is a good preconditioner of
// conjugate gradients.

void ShapeSystem::take_planes(int steps) {
  for (auto* fields : {&residual_, &direction_, &found_}) fields->resize(3 * operator_.size());
  plane_steps_ = steps;
}

/// Replaces the solution, which is the right-hand side, by the result of the steps.
template <int fields>
void ShapeSystem::descend_to_planes(ShapeFactor& factor, std::span<Vector3> steps) {
  constexpr auto width = static_cast<std::size_t>(fields);
  const std::size_t n = width * factor.solved().size();
  const std::span residual(residual_.data(), n), direction(direction_.data(), n);
  const std::span found(found_.data(), n), solution(solution_.data(), n);
  std::ranges::copy(solution, residual.begin());
  std::ranges::fill(found, Vector3{});
  const auto precondition = [&] {
    std::ranges::copy(residual, solution.begin());
    factor.n.solve(solution_, fields);
  };
  const auto multiply = [&] { multiply_with_planes(width, factor, steps); };
  const auto advance = [&](const std::array<double, width>& lengths) {
    for (std::size_t i = 0; i < n; ++i) found[i] = found[i] + lengths[i % width] * direction[i];
  };
  const ConjugateVectors<Vector3> vectors = {residual, solution, direction, solution};
  conjugate_gradients<width>(vectors, plane_steps_, 0, precondition, multiply, advance, workers_);
  scatter(found, factor.solved(), width, steps);
}

template void ShapeSystem::descend_to_planes<1>(ShapeFactor&, std::span<Vector3>);
template void ShapeSystem::descend_to_planes<3>(ShapeFactor&, std::span<Vector3>);

/// solution = (N + weights of the planes) direction, which `steps` then hold.
void ShapeSystem::multiply_with_planes(std::size_t width, const ShapeFactor& factor,
                                       std::span<Vector3> steps) {
  const Anchors& anchors = factor.anchors;
  const auto rows = factor.solved();
  scatter(direction_, rows, width, steps);
  apply(steps, static_cast<int>(width), {scaled_residual_.data(), steps.size()});
  workers_.for_each_in_chunks(steps.size(), [&](std::size_t i) {
    scaled_residual_[i] = operator_.scale[i / width] * scaled_residual_[i];
  });
  multiply_transposed(rows, static_cast<int>(width));
  workers_.for_each_in_chunks(rows.size(), [&](std::size_t r) {
    const std::size_t v = at(rows[r]);
    for (std::size_t i = width * r; i < width * (r + 1); ++i) {
      solution_[i] = solution_[i] + anchors.weights[v] * anchors.observable(v, direction_[i]);
    }
  });
}

}  // namespace dynmesh
