#include "detail/first_order_step.hpp"

#include <algorithm>

#include "support/geometry.hpp"

namespace dynmesh {
namespace {

/// The rows of the rotation matrix of a unit quaternion.
Covariance matrix_of(const Quaternion& q) {
  const double xx = 2 * q.x * q.x, yy = 2 * q.y * q.y, zz = 2 * q.z * q.z;
  const double xy = 2 * q.x * q.y, xz = 2 * q.x * q.z, yz = 2 * q.y * q.z;
  const double wx = 2 * q.w * q.x, wy = 2 * q.w * q.y, wz = 2 * q.w * q.z;
  return {{{1 - yy - zz, xy - wz, xz + wy},
           {xy + wz, 1 - xx - zz, yz - wx},
           {xz - wy, yz + wx, 1 - xx - yy}}};
}

/// L of the weights w_ij = -C_ij, with a lower bound, since an edge without weight keeps nothing.
DetailOperator laplacian_of(const DetailOperator& k, double least_weight) {
  using Row = DetailOperator::Rows::InnerIterator;
  const auto l = std::make_shared<DetailOperator::Rows>();
  *l = *k.c;
  double sum = 0;
  double n_edges = 0;
  for (Index i = 0; i < l->rows(); ++i) {
    for (Row e(*l, i); e; ++e) {
      if (e.col() == i) continue;
      sum -= e.value();
      ++n_edges;
    }
  }
  const double floor = n_edges > 0 ? least_weight * sum / n_edges : 0;
  for (Index i = 0; i < l->rows(); ++i) {
    double weights = 0;
    for (Row e(*l, i); e; ++e) {
      if (e.col() != i) weights -= e.valueRef() = std::min(e.value(), -floor);
    }
    if (weights > 0) l->coeffRef(i, i) = weights;
  }
  return {l, std::vector<double>(k.size(), 1.0)};
}

}  // namespace

FirstOrderStep::FirstOrderStep(const DetailOperator& k, const FirstOrderConstants& constants,
                               Workers& workers)
    : workers_(workers),
      laplacian_(laplacian_of(k, constants.least_weight)),
      // It has so few entries that threads would hardly share it.
      factor_(SparseMatrix(*laplacian_.c), workers),
      edges_(laplacian_.c->nonZeros()),
      covariances_(k.size()),
      quaternions_(k.size()) {
  factor_.reserve();
}

/// Fits R to the edges of L, which it weights as L does, and stores the matrices as covariances.
void FirstOrderStep::fit_rotations(Field positions, Field last) {
  const OperatorData l = data_of(laplacian_);
  const RotationData data = {l.offsets,        l.columns,           edges_.data(),
                             positions.data(), covariances_.data(), quaternions_.data()};
  const RotationKernels& kernels = best_kernels().rotations;
  workers_.for_each_short_chunk(static_cast<Index>(quaternions_.size()),
                                [&](Index first, Index end) {
                                  for (Index i = first; i < end; ++i) {
                                    for (Index e = l.offsets[i]; e < l.offsets[i + 1]; ++e) {
                                      const std::size_t j = at(l.columns[e]);
                                      edges_[e] = -l.values[e] * (last[j] - last[i]);
                                    }
                                    quaternions_[i] = {1, 0, 0, 0};
                                  }
                                  kernels.measure(data, first, end);
                                  kernels.turn(data.covariances, data.quaternions, first, end);
                                  for (Index i = first; i < end; ++i) {
                                    covariances_[i] = matrix_of(quaternions_[i]);
                                  }
                                });
}

/// The residual of the equation of vertex v: b_v - (L X)_v.
Vector3<double> FirstOrderStep::residual(std::size_t v, Field positions) const {
  const OperatorData l = data_of(laplacian_);
  const auto turned = [](const Covariance& rotation, const Vector3<double>& edge) {
    return Vector3<double>{dot(rotation.rows[0], edge), dot(rotation.rows[1], edge),
                           dot(rotation.rows[2], edge)};
  };
  Vector3<double> sum, edges;
  for (Index e = l.offsets[v]; e < l.offsets[v + 1]; ++e) {
    const std::size_t j = at(l.columns[e]);
    const Vector3<double>& edge = edges_[e];  // w_vj (G_j - G_v)
    edges = edges + edge;
    sum = sum - 0.5 * turned(covariances_[j], edge) - l.values[e] * (positions[j] - positions[v]);
  }
  return sum - 0.5 * turned(covariances_[v], edges);
}

std::span<Vector3<double>> FirstOrderStep::find(Field positions, Field last,
                                                std::span<const std::uint8_t> is_free,
                                                std::span<Vector3<double>> scratch) {
  factor_.factorize(is_free);
  fit_rotations(positions, last);
  const auto rows = factor_.order();
  const auto solution = scratch.first(positions.size());
  const auto step = scratch.subspan(positions.size(), positions.size());
  workers_.for_each_short_chunk(static_cast<Index>(rows.size()), [&](Index first, Index end) {
    for (Index r = first; r < end; ++r) solution[r] = residual(at(rows[r]), positions);
  });
  factor_.solve(solution, 1);
  std::ranges::fill(step, Vector3<double>{});
  for (std::size_t r = 0; r < rows.size(); ++r) step[rows[r]] = solution[r];
  return step;
}

}  // namespace dynmesh
