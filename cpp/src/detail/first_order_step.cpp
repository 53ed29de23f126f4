#include "detail/first_order_step.hpp"

#include <algorithm>

#include "support/geometry.hpp"
#include "support/indices.hpp"

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
  DetailOperator result = k;
  std::ranges::fill(result.scale, 1.0);
  double sum = 0;
  std::size_t n_edges = 0;
  const auto for_each_edge = [&](const auto& visit) {
    for (std::size_t i = 0; i < k.size(); ++i) {
      for (Index e = k.offsets[i]; e < k.offsets[i + 1]; ++e) {
        if (at(k.columns[at(e)]) != i) visit(i, at(e));
      }
    }
  };
  for_each_edge([&](std::size_t, std::size_t e) {
    sum -= k.values[e];
    ++n_edges;
  });
  const double floor = n_edges == 0 ? 0 : least_weight * sum / static_cast<double>(n_edges);
  std::vector<double> diagonal(k.size());
  for_each_edge([&](std::size_t i, std::size_t e) {
    result.values[e] = -std::max(-k.values[e], floor);
    diagonal[i] -= result.values[e];
  });
  for (std::size_t i = 0; i < k.size(); ++i) {
    for (Index e = k.offsets[i]; e < k.offsets[i + 1]; ++e) {
      if (at(k.columns[at(e)]) == i) result.values[at(e)] = diagonal[i];
    }
  }
  return result;
}

}  // namespace

void FirstOrderStep::reset(const DetailOperator& k, const FirstOrderConstants& constants) {
  laplacian_ = laplacian_of(k, constants.least_weight);
  // Its factor has so few entries that threads would hardly share it.
  factor_ = std::make_unique<MaskedFactor>(
      SymmetricMatrix{laplacian_.offsets, laplacian_.columns, laplacian_.values}, workers_,
      Ordering::minimum_degree);
  factor_->reserve();
  edges_.resize(laplacian_.columns.size());
  covariances_.resize(k.size());
  quaternions_.resize(k.size());
}

/// Fits R to the edges of L, which it weights as L does, and stores the matrices as covariances.
void FirstOrderStep::fit_rotations(Field positions, Field last) {
  const DetailOperator& l = laplacian_;
  const RotationData data = {l.offsets.data(), l.columns.data(),    edges_.data(),
                             positions.data(), covariances_.data(), quaternions_.data()};
  const RotationKernels& kernels = best_kernels().rotations;
  workers_.for_each_short_chunk(static_cast<Index>(l.size()), [&](Index first, Index end) {
    for (Index i = first; i < end; ++i) {
      for (Index e = l.offsets[at(i)]; e < l.offsets[at(i) + 1]; ++e) {
        const std::size_t j = at(l.columns[at(e)]);
        edges_[at(e)] = -l.values[at(e)] * (last[j] - last[at(i)]);
      }
      quaternions_[at(i)] = {1, 0, 0, 0};
    }
    kernels.measure(data, first, end);
    kernels.turn(data.covariances, data.quaternions, first, end);
    for (Index i = first; i < end; ++i) {
      covariances_[at(i)] = matrix_of(quaternions_[at(i)]);
    }
  });
}

/// The residual of the equation of vertex v: b_v - (L X)_v.
Vector3<double> FirstOrderStep::residual(std::size_t v, Field positions) const {
  const DetailOperator& l = laplacian_;
  const auto turned = [](const Covariance& rotation, const Vector3<double>& edge) {
    return Vector3<double>{dot(rotation.rows[0], edge), dot(rotation.rows[1], edge),
                           dot(rotation.rows[2], edge)};
  };
  Vector3<double> sum, edges;
  for (Index e = l.offsets[v]; e < l.offsets[v + 1]; ++e) {
    const std::size_t j = at(l.columns[at(e)]);
    const Vector3<double>& edge = edges_[at(e)];  // w_vj (G_j - G_v)
    edges = edges + edge;
    sum =
        sum - 0.5 * turned(covariances_[j], edge) - l.values[at(e)] * (positions[j] - positions[v]);
  }
  return sum - 0.5 * turned(covariances_[v], edges);
}

std::span<Vector3<double>> FirstOrderStep::find(Field positions, Field last,
                                                std::span<const std::uint8_t> is_free,
                                                std::span<Vector3<double>> scratch) {
  factor_->factorize(is_free);
  fit_rotations(positions, last);
  const auto rows = factor_->order();
  const auto solution = scratch.first(positions.size());
  const auto step = scratch.subspan(positions.size(), positions.size());
  workers_.for_each_short_chunk(static_cast<Index>(rows.size()), [&](Index first, Index end) {
    for (Index r = first; r < end; ++r) solution[at(r)] = residual(at(rows[at(r)]), positions);
  });
  factor_->solve(solution, 1);
  std::ranges::fill(step, Vector3<double>{});
  for (std::size_t r = 0; r < rows.size(); ++r) step[at(rows[r])] = solution[r];
  return step;
}

}  // namespace dynmesh
