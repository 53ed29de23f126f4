#include "detail/shape_system.hpp"

#include <algorithm>
#include <utility>

namespace dynmesh {

ShapeSystem::ShapeSystem(std::span<const Triangle> faces, const Cells& cells, Workers& workers,
                         std::span<const Vector3<double>> first_frame,
                         const DetailConstants& constants, std::vector<double> membrane)
    : cells_(cells),
      workers_(workers),
      kernels_(best_kernels().products),
      operator_(build_detail_operator(faces, cells, first_frame, constants)),
      membrane_(std::move(membrane)),
      factor_(normal_matrix(operator_, membrane_), workers),
      scaled_residual_(3 * cells.size()),
      solution_(3 * cells.size()),
      steps_(cells.size()) {}

void ShapeSystem::apply(Field x, int fields, std::span<Vector3<double>> detail) const {
  apply_operator(operator_, x, fields, detail, workers_);
}

void ShapeSystem::factorize(const Anchors& anchors) {
  factor_.factorize(anchors.is_solved, anchors.weights);
}

/// Sets the solution to K^T of the residual at the vertices that are solved for.
void ShapeSystem::multiply_transposed(int fields) {
  const auto rows = solved();
  const OperatorData k = data_of(operator_);
  workers_.for_each_short_chunk(static_cast<Index>(rows.size()), [&](Index first, Index last) {
    kernels_.apply_transposed(k, scaled_residual_.data(), fields, rows.data(), solution_.data(),
                              first, last);
  });
}

void ShapeSystem::apply_transposed(Field detail, std::span<Vector3<double>> x) {
  workers_.for_each_in_chunks(
      cells_.size(), [&](std::size_t v) { scaled_residual_[v] = operator_.scale[v] * detail[v]; });
  multiply_transposed(1);
  scatter_to(x);
}

void ShapeSystem::multiply(Field x, std::span<Vector3<double>> product) {
  apply(x, 1, scaled_residual_);
  workers_.for_each_in_chunks(cells_.size(), [&](std::size_t v) {
    scaled_residual_[v] = operator_.scale[v] * scaled_residual_[v] + membrane_[v] * x[v];
  });
  multiply_transposed(1);
  scatter_to(product);
}

void ShapeSystem::precondition(Field right_side, std::span<Vector3<double>> x) {
  const auto order = solved();
  workers_.for_each_in_chunks(order.size(), [&](std::size_t r) {
    solution_[r] = right_side[static_cast<std::size_t>(order[r])];
  });
  factor_.precondition(solution_, 1);
  scatter_to(x);
}

void ShapeSystem::scatter_to(std::span<Vector3<double>> x) const {
  const auto order = solved();
  workers_.for_each_in_chunks(
      order.size(), [&](std::size_t r) { x[static_cast<std::size_t>(order[r])] = solution_[r]; });
}

/// Solves for the steps, and brings them into the order of vertices.
ShapeSystem::Field ShapeSystem::solve_and_scatter(int fields) {
  factor_.solve(solution_, fields);
  return scatter(solution_, static_cast<std::size_t>(fields));
}

ShapeSystem::Field ShapeSystem::scatter(std::span<const Vector3<double>> rows, std::size_t width) {
  const auto order = solved();
  const auto steps = side_by_side(std::span(steps_)).first(width * cells_.size());
  if (order.size() < cells_.size()) std::ranges::fill(steps, Vector3<double>{});
  workers_.for_each_in_chunks(order.size(), [&](std::size_t r) {
    const auto v = static_cast<std::size_t>(order[r]);
    for (std::size_t f = 0; f < width; ++f) steps[width * v + f] = rows[width * r + f];
  });
  return steps;
}

}  // namespace dynmesh
