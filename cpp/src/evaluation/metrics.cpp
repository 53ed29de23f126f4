#include <algorithm>
#include <cmath>
#include <dynmesh/metrics.hpp>
#include <vector>

#include "base/arguments.hpp"
#include "base/default_arithmetic.hpp"
#include "base/geometry.hpp"

namespace dynmesh {
namespace {

/// Returns GL(v_i), eq. (6).
Vector3 geometric_laplacian(const Cells& cells, const std::vector<Vector3>& frame,
                            std::size_t vertex, double shortest) {
  const Vector3 v_i = frame[vertex];
  if (cells[vertex].empty()) return {};
  Vector3 sum;
  double weights = 0;
  for (const Index neighbour : cells[vertex]) {
    const Vector3& v_j = frame[neighbour];
    const double inverse_distance = 1 / std::max(std::sqrt(squared_norm(v_i - v_j)), shortest);
    sum = sum + inverse_distance * v_j;
    weights += inverse_distance;
  }
  return v_i - (1 / weights) * sum;
}

}  // namespace

template <class Real>
double nmsve(const Cells& cells, Points<const Real> reference, Points<const Real> completed) {
  const DefaultArithmetic arithmetic;
  const std::size_t k = cells.size();
  if (k == 0) refuse("reference", "has no vertices");
  const auto v = complete_frame("reference", reference, k);
  const auto w = complete_frame("completed", completed, k);
  const double shortest = std::sqrt(squared_length_floor) * mean_edge_length(cells, v);
  double sum = 0;
  for (std::size_t i = 0; i < k; ++i) {
    const auto laplacian_error =
        geometric_laplacian(cells, v, i, shortest) - geometric_laplacian(cells, w, i, shortest);
    sum += std::sqrt(squared_norm(v[i] - w[i])) + std::sqrt(squared_norm(laplacian_error));
  }
  return sum / (2 * static_cast<double>(k));  // eq. (5)
}

template <class Real>
void vertex_error(Points<const Real> reference, Points<const Real> completed,
                  std::span<double> error) {
  const DefaultArithmetic arithmetic;
  const auto v = complete_frame("reference", reference, error.size());
  const auto w = complete_frame("completed", completed, error.size());
  for (std::size_t i = 0; i < error.size(); ++i) error[i] = std::sqrt(squared_norm(v[i] - w[i]));
}

template double nmsve(const Cells&, Points<const float>, Points<const float>);
template double nmsve(const Cells&, Points<const double>, Points<const double>);
template void vertex_error(Points<const float>, Points<const float>, std::span<double>);
template void vertex_error(Points<const double>, Points<const double>, std::span<double>);

}  // namespace dynmesh
