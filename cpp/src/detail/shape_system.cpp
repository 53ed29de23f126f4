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
void ShapeSystem::reset(std::span<const Triangle> faces, std::span<const Vector3<Real>> first_frame,
                        const DetailConstants& constants) {
  auto k = build_detail_operator<Real>(faces, cells_, first_frame, constants);
  factor_ = std::make_unique<MaskedFactor>(
      normal_matrix(k));  // first, since it may throw if memory is exhausted
  operator_ = std::move(k);
}

template void ShapeSystem::reset(std::span<const Triangle>, std::span<const Vector3<float>>,
                                 const DetailConstants&);
template void ShapeSystem::reset(std::span<const Triangle>, std::span<const Vector3<double>>,
                                 const DetailConstants&);

OperatorData ShapeSystem::operator_data() const {
  return {operator_.offsets.data(), operator_.columns.data(), operator_.values.data(),
          operator_.scale.data()};
}

void ShapeSystem::apply(Field x, int fields, std::span<Vector3<double>> detail) const {
  const OperatorData k = operator_data();
  workers_.for_each_short_chunk(static_cast<Index>(cells_.size()), [&](Index first, Index last) {
    kernels_.apply(k, x.data(), fields, detail.data(), first, last);
  });
}

void ShapeSystem::factorize(const Anchors& anchors) {
  factor_->factorize(anchors.is_solved, anchors.weights);
}

ShapeSystem::Field ShapeSystem::solve_scaled(int fields, Field x, const Anchors& anchors) {
  const auto rows = solved();
  const OperatorData k = operator_data();
  workers_.for_each_short_chunk(static_cast<Index>(rows.size()), [&](Index first, Index last) {
    kernels_.apply_transposed(k, scaled_residual_.data(), fields, rows.data(), solution_.data(),
                              first, last);
  });
  const auto width = static_cast<std::size_t>(fields);
  if (anchors.are_noisy()) {
    for (std::size_t r = 0; r < rows.size(); ++r) {
      const auto v = static_cast<std::size_t>(rows[r]);
      solution_[width * r] =
          solution_[width * r] + anchors.weights[v] * (anchors.observed[v] - x[v]);
    }
  }
  factor_->solve(solution_, fields);
  std::fill_n(steps_.begin(), width * cells_.size(), Vector3<double>{});
  for (std::size_t r = 0; r < rows.size(); ++r) {
    const auto v = static_cast<std::size_t>(rows[r]);
    for (std::size_t f = 0; f < width; ++f) steps_[width * v + f] = solution_[width * r + f];
  }
  return {steps_.data(), width * cells_.size()};
}

}  // namespace dynmesh
