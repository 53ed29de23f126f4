/// The steps of a shape system whose anchors are planes. These tie the three coordinates together,
/// so that the system has 3 k unknowns and is not factored. N + weights, which has k, bounds it
/// from above and is a good preconditioner of conjugate gradients.
#include <algorithm>
#include <array>
#include <cstddef>

#include "detail/shape_system.hpp"
#include "support/conjugate_gradients.hpp"

namespace dynmesh {

void ShapeSystem::take_planes(int steps) {
  for (auto* fields : {&residual_, &direction_, &found_}) fields->resize(3 * cells_.size());
  plane_steps_ = steps;
}

/// Replaces the solution, which is the right-hand side, by the result of the steps.
template <int fields>
ShapeSystem::Field ShapeSystem::descend_to_planes(const Anchors& anchors) {
  constexpr auto width = static_cast<std::size_t>(fields);
  const std::size_t n = width * solved().size();
  const std::span residual(residual_.data(), n), direction(direction_.data(), n);
  const std::span found(found_.data(), n), solution(solution_.data(), n);
  std::ranges::copy(solution, residual.begin());
  std::ranges::fill(found, Vector3<double>{});
  const auto precondition = [&] {
    std::ranges::copy(residual, solution.begin());
    factor_.precondition(solution_, fields);
  };
  const auto multiply = [&] { multiply_with_planes(width, anchors); };
  const auto advance = [&](const std::array<double, width>& lengths) {
    for (std::size_t i = 0; i < n; ++i) found[i] = found[i] + lengths[i % width] * direction[i];
  };
  const ConjugateVectors<Vector3<double>> vectors = {residual, solution, direction, solution};
  conjugate_gradients<width>(vectors, plane_steps_, 0, precondition, multiply, advance);
  return scatter(found, width);
}

template ShapeSystem::Field ShapeSystem::descend_to_planes<1>(const Anchors&);
template ShapeSystem::Field ShapeSystem::descend_to_planes<3>(const Anchors&);

/// solution = (N + weights of the planes) direction.
void ShapeSystem::multiply_with_planes(std::size_t width, const Anchors& anchors) {
  const auto rows = solved();
  const Field steps = scatter(direction_, width);
  apply(steps, static_cast<int>(width), {scaled_residual_.data(), steps.size()});
  workers_.for_each_in_chunks(steps.size(), [&](std::size_t i) {
    scaled_residual_[i] = operator_.scale[i / width] * scaled_residual_[i];
  });
  multiply_transposed(static_cast<int>(width));
  workers_.for_each_in_chunks(rows.size(), [&](std::size_t r) {
    const auto v = static_cast<std::size_t>(rows[r]);
    for (std::size_t i = width * r; i < width * (r + 1); ++i) {
      solution_[i] = solution_[i] + anchors.weights[v] * anchors.observable(v, direction_[i]);
    }
  });
}

}  // namespace dynmesh
