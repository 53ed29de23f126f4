#include "tracking/surface_rows.hpp"

#include <Eigen/Dense>
#include <cmath>

#include "support/geometry.hpp"
#include "support/rigid_motion.hpp"

namespace dynmesh {

Eigen::Isometry3d fit_to_planes(std::span<const SurfaceRow> rows,
                                std::span<const Vector3<double>> x) {
  const auto nothing = Eigen::Isometry3d::Identity();
  Eigen::Vector3d centre = Eigen::Vector3d::Zero();
  double total = 0;
  for (const SurfaceRow& row : rows) {
    centre += row.weight * to_eigen(row.on(x));
    total += row.weight;
  }
  if (!(total > 0)) return nothing;
  centre /= total;
  double square = 0;
  for (const SurfaceRow& row : rows) {
    square += row.weight * (to_eigen(row.on(x)) - centre).squaredNorm();
  }
  const double reach = std::sqrt(square / total);
  if (!(reach > 0) || !std::isfinite(reach)) return nothing;
  Eigen::Matrix<double, 6, 6> normal = Eigen::Matrix<double, 6, 6>::Zero();
  Eigen::Matrix<double, 6, 1> right = Eigen::Matrix<double, 6, 1>::Zero();
  for (const SurfaceRow& row : rows) {
    const Eigen::Vector3d arm = to_eigen(row.on(x)) - centre;
    const Eigen::Vector3d n = to_eigen(row.normal);
    Eigen::Matrix<double, 6, 1> moved;
    moved << (arm / reach).cross(n), n;
    normal += row.weight * moved * moved.transpose();
    right += row.weight * n.dot(to_eigen(row.point) - centre - arm) * moved;
  }
  constexpr double caution = 1e-3;  // the share of the mean diagonal that is added
  normal.diagonal().array() += caution * normal.trace() / 6;
  const Eigen::Matrix<double, 6, 1> solution = normal.ldlt().solve(right);
  if (!solution.allFinite()) return nothing;
  const Eigen::Vector3d turn = solution.head<3>() / reach;
  const Eigen::AngleAxisd rotation(turn.norm(), turn.normalized());
  return Eigen::Translation3d(centre + solution.tail<3>()) * rotation *
         Eigen::Translation3d(-centre);
}

void SurfaceRows::index(std::size_t n_vertices) {
  copies_.clear();
  ends_.assign(n_vertices + 1, 0);
  for (const SurfaceRow& row : rows) {
    const auto normal = std::sqrt(row.weight) * row.normal;
    Copy& copy = copies_.emplace_back();
    for (std::size_t s = 0; s < 3; ++s) {
      copy.corners[s] = row.corners[s];
      copy.parts[s] = {static_cast<float>(row.shares[s] * normal.x),
                       static_cast<float>(row.shares[s] * normal.y),
                       static_cast<float>(row.shares[s] * normal.z)};
      ++ends_[row.corners[s] + 1];
    }
  }
  for (std::size_t v = 0; v < n_vertices; ++v) ends_[v + 1] += ends_[v];
  entries_.resize(3 * rows.size());
  auto next = ends_;
  for (std::uint32_t r = 0; r < copies_.size(); ++r) {
    for (std::size_t s = 0; s < 3; ++s) {
      entries_[next[copies_[r].corners[s]]++] = {r, copies_[r].parts[s]};
    }
  }
  along_.resize(rows.size());
}

void SurfaceRows::add_forces(Field x, std::span<Vector3<double>> forces) const {
  for (const SurfaceRow& row : rows) {
    const auto force = row.weight * dot(row.normal, row.point - row.on(x)) * row.normal;
    for (std::size_t s = 0; s < 3; ++s) {
      forces[row.corners[s]] = forces[row.corners[s]] + row.shares[s] * force;
    }
  }
}

void SurfaceRows::add_product(Field step, std::span<Vector3<double>> product, Workers& workers) {
  workers.for_each_in_chunks(copies_.size(), [&](std::size_t r) {
    const Copy& copy = copies_[r];
    double sum = 0;
    for (std::size_t s = 0; s < 3; ++s) sum += dot(in_double(copy.parts[s]), step[copy.corners[s]]);
    along_[r] = sum;
  });
  workers.for_each_in_chunks(product.size(), [&](std::size_t v) {
    Vector3<double> sum = product[v];
    for (std::uint32_t e = ends_[v]; e < ends_[v + 1]; ++e) {
      sum = sum + along_[entries_[e].row] * in_double(entries_[e].part);
    }
    product[v] = sum;
  });
}

}  // namespace dynmesh
