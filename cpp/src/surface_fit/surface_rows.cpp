#include "surface_fit/surface_rows.hpp"

#include <Eigen/Dense>
#include <cmath>
#include <numeric>

#include "base/geometry.hpp"

namespace dynmesh {
PlaneMotion::PlaneMotion(std::span<const SurfaceRow> rows, Field x) {
  for (const SurfaceRow& row : rows) {
    centre += row.weight * to_eigen(row.on(x));
    weight += row.weight;
  }
  if (!(weight > 0)) return;
  centre /= weight;
  double square = 0;
  for (const SurfaceRow& row : rows) {
    square += row.weight * (to_eigen(row.on(x)) - centre).squaredNorm();
  }
  const double root = std::sqrt(square / weight);
  if (!(root > 0) || !std::isfinite(root)) {
    weight = 0;
    return;
  }
  reach = root;
  for (const SurfaceRow& row : rows) {
    const Eigen::Vector3d arm = to_eigen(row.on(x)) - centre;
    const Eigen::Vector3d n = to_eigen(row.normal);
    Vector moved;
    moved << (arm / reach).cross(n), n;
    normal += row.weight * moved * moved.transpose();
    right += row.weight * n.dot(to_eigen(row.point) - centre - arm) * moved;
  }
  constexpr double caution = 1e-3;  // the share of the mean diagonal that is added
  normal.diagonal().array() += caution * normal.trace() / 6;
}

PlaneMotion::PlaneMotion(Field positions, double reach_of_one) {
  for (const Vector3& position : positions) centre += to_eigen(position);
  centre /= static_cast<double>(positions.size());
  double square = 0;
  for (const Vector3& position : positions) square += (to_eigen(position) - centre).squaredNorm();
  const double root = std::sqrt(square / static_cast<double>(positions.size()));
  reach = root > 0 && std::isfinite(root) ? root : reach_of_one;
}

Eigen::Isometry3d PlaneMotion::motion(const Vector& solution) const {
  const Eigen::Vector3d turn = solution.head<3>() / reach;
  const Eigen::AngleAxisd rotation(turn.norm(), turn.normalized());
  return Eigen::Translation3d(centre + solution.tail<3>()) * rotation *
         Eigen::Translation3d(-centre);
}

Eigen::Isometry3d fit_to_planes(std::span<const SurfaceRow> rows, Field x) {
  const auto nothing = Eigen::Isometry3d::Identity();
  const PlaneMotion sums(rows, x);
  if (!(sums.weight > 0)) return nothing;
  const PlaneMotion::Vector solution = sums.normal.ldlt().solve(sums.right);
  return solution.allFinite() ? sums.motion(solution) : nothing;
}

namespace {

std::array<float, 3> rounded(const Vector3& v) {
  return {static_cast<float>(v.x), static_cast<float>(v.y), static_cast<float>(v.z)};
}
Vector3 widened(const std::array<float, 3>& v) { return {v[0], v[1], v[2]}; }

}  // namespace

RowProduct::RowProduct(std::span<const SurfaceRow> rows, std::size_t k, Workers& workers)
    : given_(rows), workers_(workers), along_(rows.size()), first_of_(k + 1) {
  for (const SurfaceRow& row : rows) {
    for (const auto corner : row.corners) ++first_of_[corner + 1];
  }
  std::partial_sum(first_of_.begin(), first_of_.end(), first_of_.begin());
  auto next = first_of_;
  std::vector<std::array<std::uint32_t, 3>> numbers(rows.size());  // in corners_
  for (std::size_t r = 0; r < rows.size(); ++r) {
    for (std::size_t s = 0; s < 3; ++s) numbers[r][s] = next[rows[r].corners[s]]++;
  }
  rows_.resize(rows.size());
  corners_.resize(3 * rows.size());
  workers.for_each_in_chunks(rows.size(), [&](std::size_t r) {
    const auto normal = std::sqrt(rows[r].weight) * rows[r].normal;
    const auto& shares = rows[r].shares;
    rows_[r] = {rows[r].corners, rounded({shares[0], shares[1], shares[2]}), rounded(normal)};
    for (std::size_t s = 0; s < 3; ++s) {
      corners_[numbers[r][s]] = {static_cast<std::uint32_t>(r), rounded(shares[s] * normal)};
    }
  });
}

void RowProduct::add(Field step, std::span<Vector3> product) {
  workers_.for_each_in_chunks(rows_.size(), [&](std::size_t r) {
    const auto& [corners, shares, normal] = rows_[r];
    const Vector3 b = widened(shares);
    const auto moved = b.x * step[corners[0]] + b.y * step[corners[1]] + b.z * step[corners[2]];
    along_[r] = dot(widened(normal), moved);
  });
  add_along(product);
}

void RowProduct::add_forces(Field x, std::span<Vector3> forces) {
  workers_.for_each_in_chunks(rows_.size(), [&](std::size_t r) {
    along_[r] = dot(widened(rows_[r].normal), given_[r].point - given_[r].on(x));
  });
  add_along(forces);
}

void RowProduct::add_along(std::span<Vector3> sums) {
  workers_.for_each_in_chunks(sums.size(), [&](std::size_t v) {
    Vector3 sum = sums[v];
    for (std::uint32_t i = first_of_[v]; i < first_of_[v + 1]; ++i) {
      sum = sum + along_[corners_[i].row] * widened(corners_[i].normal);
    }
    sums[v] = sum;
  });
}

}  // namespace dynmesh
