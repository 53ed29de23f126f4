#include "detail/shape_system.hpp"

#include <algorithm>
#include <utility>

namespace dynmesh {

ShapeSystem::ShapeSystem(const Cells& cells, Workers& workers)
    : cells_(cells),
      workers_(workers),
      kernels_(best_kernels().products),
      scaled_residual_(3 * cells.size()),
      solution_(3 * cells.size()),
      steps_(3 * cells.size()) {}

template <class Real>
ShapeSystem::Prepared ShapeSystem::prepare(std::span<const Triangle> faces,
                                           std::span<const Vector3<Real>> first_frame,
                                           const DetailConstants& constants) const {
  auto k = build_detail_operator<Real>(faces, cells_, first_frame, constants);
  auto factor = std::make_unique<MaskedFactor>(normal_matrix(k), workers_);
  return {std::move(k), std::move(factor)};
}

template ShapeSystem::Prepared ShapeSystem::prepare(std::span<const Triangle>,
                                                    std::span<const Vector3<float>>,
                                                    const DetailConstants&) const;
template ShapeSystem::Prepared ShapeSystem::prepare(std::span<const Triangle>,
                                                    std::span<const Vector3<double>>,
                                                    const DetailConstants&) const;

void ShapeSystem::reset(Prepared prepared) noexcept {
  operator_ = std::move(prepared.k);
  factor_ = std::move(prepared.factor);
}

void ShapeSystem::apply(Field x, int fields, std::span<Vector3<double>> detail) const {
  apply_operator(operator_, x, fields, detail, workers_);
}

void ShapeSystem::factorize(const Anchors& anchors) {
  factor_->factorize(anchors.is_solved, anchors.weights);
}

void ShapeSystem::apply_transposed(Field residual, std::span<Vector3<double>> pull) {
  for (std::size_t v = 0; v < residual.size(); ++v) {
    scaled_residual_[v] = operator_.scale[v] * residual[v];
  }
  multiply_transposed(1);
  from_order_of_elimination(pull);
}

void ShapeSystem::solve_normal(Field right_hand_side, std::span<Vector3<double>> x) {
  const auto rows = solved();
  for (std::size_t r = 0; r < rows.size(); ++r) {
    solution_[r] = right_hand_side[static_cast<std::size_t>(rows[r])];
  }
  factor_->solve(solution_, 1);
  from_order_of_elimination(x);
}

void ShapeSystem::from_order_of_elimination(std::span<Vector3<double>> values) const {
  const auto rows = solved();
  if (rows.size() < values.size()) std::ranges::fill(values, Vector3<double>{});
  for (std::size_t r = 0; r < rows.size(); ++r) {
    values[static_cast<std::size_t>(rows[r])] = solution_[r];
  }
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

/// Solves for the steps, and brings them into the order of vertices.
ShapeSystem::Field ShapeSystem::solve_and_scatter(int fields) {
  factor_->solve(solution_, fields);
  return scatter(solution_, static_cast<std::size_t>(fields));
}

ShapeSystem::Field ShapeSystem::scatter(std::span<const Vector3<double>> rows, std::size_t width) {
  const auto order = solved();
  const Field steps = {steps_.data(), width * cells_.size()};
  if (order.size() < cells_.size()) std::fill_n(steps_.begin(), steps.size(), Vector3<double>{});
  for (std::size_t r = 0; r < order.size(); ++r) {
    const auto v = static_cast<std::size_t>(order[r]);
    for (std::size_t f = 0; f < width; ++f) steps_[width * v + f] = rows[width * r + f];
  }
  return steps;
}

}  // namespace dynmesh
