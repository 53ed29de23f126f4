/// Rotations and triangulations of method detail.
#include <doctest/doctest.h>

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <vector>

#include "base/workers.hpp"
#include "mesh/intrinsic_delaunay.hpp"
#include "meshes.hpp"
#include "shape/detail_operator.hpp"
#include "shape/rotations.hpp"

namespace dynmesh::testing {
namespace {

TEST_CASE("if a cell does not determine a rotation, it keeps the last one") {
  auto mesh = sheet<double>(3);
  mesh.vertices.insert(mesh.vertices.end(), {5, 5, 5});  // isolated
  const Topology topology = build_topology(mesh.faces(), mesh.size());
  Workers workers(1);
  const Surroundings surroundings(topology.cells, rows_of(mesh.vertices), 1);
  Rotations rotations(surroundings, workers);
  std::vector<Quaternion> q(mesh.size(), Quaternion{1, 0, 0, 0});
  rotations.fit(rows_of(turned(mesh.vertices, 0.5)), q);
  const std::vector<Quaternion> before = q;
  CHECK(before.back().w == 1);
  SUBCASE("all vertices coincide") {
    rotations.fit(std::vector<Vector3>(mesh.size(), Vector3{1, 2, 3}), q);
  }
  SUBCASE("out of range") {
    rotations.fit(std::vector<Vector3>(mesh.size(), Vector3{1e308, 0, 0}), q);
  }
  for (std::size_t v = 0; v < before.size(); ++v) {
    CHECK(q[v].w == doctest::Approx(before[v].w));
    CHECK(q[v].z == doctest::Approx(before[v].z));
  }
}

using Matrix3 = Eigen::Matrix3d;

/// The rotations that a kernel fits to these covariances.
std::vector<Quaternion> turn(const RotationKernels& kernels,
                             const std::vector<Matrix3>& covariances,
                             const std::vector<Quaternion>& last) {
  const auto n = static_cast<Index>(covariances.size());
  std::vector<Covariance> given(covariances.size());
  for (std::size_t i = 0; i < given.size(); ++i) {
    for (int row = 0; row < 3; ++row) {
      const auto& s = covariances[i];
      given[i].rows[row] = {s(row, 0), s(row, 1), s(row, 2)};
    }
  }
  std::vector<Quaternion> quaternions = last;
  kernels.fit(given.data(), quaternions.data(), 0, n);
  return quaternions;
}

Eigen::Quaterniond eigen(const Quaternion& q) { return {q.w, q.x, q.y, q.z}; }

/// The largest tr(R^T S) over all rotations R.
double largest_trace(const Matrix3& s) {
  const Eigen::JacobiSVD<Matrix3> svd(s, Eigen::ComputeFullU | Eigen::ComputeFullV);
  const Eigen::Vector3d values = svd.singularValues();
  const bool is_reflected = (svd.matrixU() * svd.matrixV().transpose()).determinant() < 0;
  return values[0] + values[1] + (is_reflected ? -values[2] : values[2]);
}

/// Covariances of all ranks, with and without reflections and equal singular values, in several
/// orientations.
std::vector<Matrix3> covariances_of_every_kind() {
  const Eigen::Vector3d skew = Eigen::Vector3d(1, 2, 3).normalized();
  const double pi = std::acos(-1.0);
  std::vector<Matrix3> turns = {Matrix3::Identity()};
  for (const Eigen::Vector3d& axis :
       {Eigen::Vector3d(1, 0, 0), Eigen::Vector3d(0, 1, 0), Eigen::Vector3d(0, 0, 1), skew}) {
    for (const double angle : {0.3, 3.0, pi - 1e-9, pi}) {
      turns.push_back(Eigen::AngleAxisd(angle, axis).toRotationMatrix());
    }
  }
  // Exactly half a turn, which the rounded value of pi does not give.
  for (int axis = 0; axis < 3; ++axis) {
    Eigen::Vector3d signs(-1, -1, -1);
    signs[axis] = 1;
    turns.emplace_back(signs.asDiagonal());
  }
  std::vector<Matrix3> found;
  const auto add = [&](double a, double b, double c) {
    for (const Matrix3& turn : turns) {
      for (const Matrix3& other : turns) {
        found.push_back(turn * Eigen::Vector3d(a, b, c).asDiagonal() * other.transpose());
      }
    }
  };
  for (const double sign : {1.0, -1.0}) {
    add(3, 2, sign);
    add(3, 1, sign);
    add(1, 1, sign);
    add(3, 3, sign);
    add(3, 2, sign * 1e-9);
    add(3, sign * 1e-3, 1e-9);
    add(3, sign * 1e-9, 1e-9);
    add(sign * 3, 0, 0);
    add(sign * 3, 2, 0);
    add(2, sign * 2, 0);
  }
  add(0, 0, 0);
  return found;
}

TEST_CASE("the best rotation is found for every covariance and from every last rotation") {
  const auto covariances = covariances_of_every_kind();
  std::vector<double> best;
  for (const Matrix3& s : covariances) best.push_back(largest_trace(s));
  const std::vector<Eigen::Quaterniond> starts = {
      {1, 0, 0, 0}, {0, 1, 0, 0}, {0, 0, 0, 1}, Eigen::Quaterniond(1, 2, 3, 4).normalized()};
  for (const Kernels& level : runnable_kernels()) {
    const RotationKernels& kernels = level.rotations;
    for (const double scale : {1.0, 1e-12, 1e12, 1e-200, 1e200}) {
      for (const Eigen::Quaterniond& start : starts) {
        std::vector<Matrix3> given;
        for (const Matrix3& s : covariances) given.emplace_back(scale * s);
        const std::vector<Quaternion> last(given.size(),
                                           {start.w(), start.x(), start.y(), start.z()});
        const auto found = turn(kernels, given, last);
        double worst = 0;
        for (std::size_t i = 0; i < given.size(); ++i) {
          const Eigen::Quaterniond q = eigen(found[i]);
          const double trace = (q.toRotationMatrix().transpose() * covariances[i]).trace();
          const double error = std::abs(q.norm() - 1) + std::abs(trace - best[i]);
          worst = std::max(worst, std::isfinite(error) ? error : 1e300);
        }
        CAPTURE(scale);
        CAPTURE(start.x());
        CHECK(worst < 1e-6);
      }
    }
  }
}

TEST_CASE("if several rotations are equally good, the one nearest to the last is chosen") {
  const auto last = Eigen::Quaterniond(1, 2, 3, 4).normalized();
  const Matrix3 turned = last.toRotationMatrix();
  const Eigen::Vector3d along(1, 2, 2);
  const Matrix3 nothing = Matrix3::Zero();
  const Matrix3 line = turned * along * along.transpose();
  const Matrix3 reflection = -turned;  // followed by any half turn it is equally good
  for (const Kernels& level : runnable_kernels()) {
    const RotationKernels& kernels = level.rotations;
    const Quaternion given{last.w(), last.x(), last.y(), last.z()};
    const auto found = turn(kernels, {nothing, line}, {given, given});
    for (const Quaternion& q : found) CHECK(eigen(q).angularDistance(last) < 2e-6);
    const auto reflected = turn(kernels, {reflection}, {given});
    const auto again = turn(kernels, {reflection}, reflected);
    CHECK(eigen(again[0]).angularDistance(eigen(reflected[0])) < 2e-6);
  }
}

TEST_CASE("degenerate triangles and non-manifold edges are handled") {
  const std::vector<Vector3> frame = {{0, 0, 0}, {1, 0, 0},   {1, 0, 0},      {2, 0, 0},
                                      {0, 1, 0}, {0.5, 9, 0}, {0.5, -1e-9, 0}};
  const std::vector<Triangle> faces = {{0, 1, 2}, {0, 1, 3}, {0, 1, 4}, {1, 0, 5}, {0, 1, 6},
                                       {3, 3, 4}, {0, 1, 4}, {1, 0, 4}, {4, 3, 5}, {5, 3, 4}};
  const auto triangles = intrinsic_delaunay(faces, frame, 1);
  CHECK(triangles.size() == 9);
  for (const auto& t : triangles) {
    CHECK(t.area() > 0);
    for (std::size_t s = 0; s < 3; ++s) CHECK(std::abs(t.cotangent(s)) < 1e6);
  }
}

}  // namespace
}  // namespace dynmesh::testing
