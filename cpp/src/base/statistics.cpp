#include "base/statistics.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <utility>

namespace dynmesh {

double median(std::span<double> values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::ranges::nth_element(values, middle);
  if (values.size() % 2 == 1) return *middle;
  return (*middle + *std::max_element(values.begin(), middle)) / 2;
}

double quantile(std::vector<double> values, double share) {
  const double place = share * static_cast<double>(values.size() - 1);
  const auto below = static_cast<std::size_t>(place);
  const auto at = values.begin() + static_cast<std::ptrdiff_t>(below);
  std::nth_element(values.begin(), at, values.end());
  if (below + 1 == values.size()) return *at;
  const double above = *std::min_element(at + 1, values.end());
  return *at + (place - static_cast<double>(below)) * (above - *at);
}

Vector3 median_of(Field points) {
  const auto of = [&](double Vector3::*coordinate) {
    std::vector<double> values(points.size());
    std::ranges::transform(points, values.begin(), coordinate);
    return quantile(std::move(values), 0.5);
  };
  return {of(&Vector3::x), of(&Vector3::y), of(&Vector3::z)};
}

double size_of(Field points) {
  const auto middle = median_of(points);
  std::vector<double> distances;
  for (const auto& point : points) {
    const auto arm = point - middle;
    distances.push_back(std::hypot(arm.x, arm.y, arm.z));
  }
  return 2 * quantile(std::move(distances), 0.9);
}

}  // namespace dynmesh
