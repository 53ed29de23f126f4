/// The steps of a shape system whose anchors are planes. These tie the three coordinates together,
/// so that the system has 3 k unknowns and is not factored. N + weights, which has k, bounds it
/// from above and is a good preconditioner of conjugate gradients.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

#include "detail/shape_system.hpp"
#include "support/geometry.hpp"

namespace dynmesh {
namespace {

constexpr std::size_t most_fields = 3;

/// The products of two arrays of fields side by side, of each field by itself.
std::array<double, most_fields> products(std::span<const Vector3<double>> a,
                                         std::span<const Vector3<double>> b, std::size_t width) {
  std::array<double, most_fields> sums{};
  for (std::size_t i = 0; i < a.size(); i += width) {
    for (std::size_t f = 0; f < width; ++f) sums[f] += dot(a[i + f], b[i + f]);
  }
  return sums;
}

double ratio_of(double a, double b) {
  const double ratio = b > 0 ? a / b : 0;
  return std::isfinite(ratio) ? ratio : 0;
}

}  // namespace

void ShapeSystem::take_planes(int steps) {
  for (auto* fields : {&residual_, &direction_, &found_}) {
    fields->resize(most_fields * cells_.size());
  }
  plane_steps_ = steps;
}

/// Replaces the solution, which is the right-hand side, by the result of the steps from 0.
ShapeSystem::Field ShapeSystem::descend_to_planes(int fields, const Anchors& anchors) {
  const auto width = static_cast<std::size_t>(fields);
  const std::size_t n = width * solved().size();
  const std::span residual(residual_.data(), n), direction(direction_.data(), n);
  const std::span found(found_.data(), n), solution(solution_.data(), n);
  std::ranges::copy(solution, residual.begin());
  std::ranges::fill(direction, Vector3<double>{});
  std::ranges::fill(found, Vector3<double>{});
  std::array<double, most_fields> last_slope{};
  for (int step = 0; step < plane_steps_; ++step) {
    std::ranges::copy(residual, solution.begin());
    factor_->solve(solution_, fields);
    const auto slope = products(residual, solution, width);
    for (std::size_t i = 0; i < n; ++i) {
      const std::size_t f = i % width;
      direction[i] = solution[i] + ratio_of(slope[f], last_slope[f]) * direction[i];
    }
    last_slope = slope;
    multiply_with_planes(width, anchors);
    const auto curvature = products(direction, solution, width);
    for (std::size_t i = 0; i < n; ++i) {
      const double length = ratio_of(slope[i % width], curvature[i % width]);
      found[i] = found[i] + length * direction[i];
      residual[i] = residual[i] - length * solution[i];
    }
  }
  return scatter(found, width);
}

/// solution = (N + weights of the planes) direction.
void ShapeSystem::multiply_with_planes(std::size_t width, const Anchors& anchors) {
  const auto rows = solved();
  const Field steps = scatter(direction_, width);
  apply(steps, static_cast<int>(width), {scaled_residual_.data(), steps.size()});
  for (std::size_t i = 0; i < steps.size(); ++i) {
    scaled_residual_[i] = operator_.scale[i / width] * scaled_residual_[i];
  }
  multiply_transposed(static_cast<int>(width));
  for (std::size_t r = 0; r < rows.size(); ++r) {
    const auto v = static_cast<std::size_t>(rows[r]);
    for (std::size_t i = width * r; i < width * (r + 1); ++i) {
      solution_[i] = solution_[i] + anchors.weights[v] * anchors.observable(v, direction_[i]);
    }
  }
}

}  // namespace dynmesh
