#include "detail/rotations.hpp"

#include <doctest/doctest.h>

#include <Eigen/Geometry>

#include "meshes.hpp"

namespace dynmesh::testing {
namespace {

std::vector<Vector3<double>> rows_of(const std::vector<double>& vertices) {
  std::vector<Vector3<double>> rows;
  for (std::size_t i = 0; i < vertices.size(); i += 3) {
    rows.push_back({vertices[i], vertices[i + 1], vertices[i + 2]});
  }
  return rows;
}

TEST_CASE("a turn is found, up to nearly half a turn, whatever the processor and the scale") {
  const auto mesh = sheet<double>(7);
  const Topology topology = build_topology(mesh.faces(), mesh.size());
  const auto rest = rows_of(mesh.vertices);
  Workers workers(1);
  for (const RotationKernels* kernels : runnable_rotation_kernels()) {
    for (const double scale : {1.0, 1e-100, 1e100}) {
      for (const double angle : {0.0, 1e-6, 0.5, 1.5, 3.0}) {
        for (const Eigen::Vector3d& axis :
             {Eigen::Vector3d(0, 0, 1), Eigen::Vector3d(1, 0, 0), Eigen::Vector3d(1, -2, 3)}) {
          const Eigen::AngleAxisd turn(angle, axis.normalized());
          const Eigen::Quaterniond expected(turn);
          auto frame = rest;
          for (auto& v : frame) {
            const Eigen::Vector3d moved = scale * (turn * Eigen::Vector3d(v.x, v.y, v.z));
            v = {moved.x(), moved.y(), moved.z()};
          }
          Rotations rotations(topology.cells, workers, *kernels);
          rotations.reset(rest, 1);
          rotations.fit(frame);
          for (const Quaternion& q : rotations.quaternions()) {
            const Eigen::Quaterniond found(q.w, q.x, q.y, q.z);
            CHECK(found.norm() == doctest::Approx(1));
            CHECK(std::abs(found.dot(expected)) == doctest::Approx(1).epsilon(1e-12));
          }
        }
      }
    }
  }
}

TEST_CASE("where cells do not tell, the last rotation stays") {
  auto mesh = sheet<double>(3);
  mesh.vertices.insert(mesh.vertices.end(), {5, 5, 5});  // isolated
  const Topology topology = build_topology(mesh.faces(), mesh.size());
  Workers workers(1);
  Rotations rotations(topology.cells, workers);
  rotations.reset(rows_of(mesh.vertices), 1);
  rotations.fit(rows_of(turned(mesh.vertices, 0.5)));
  const std::vector<Quaternion> before(rotations.quaternions().begin(),
                                       rotations.quaternions().end());
  CHECK(before.back().w == 1);
  SUBCASE("all in one place") {
    rotations.fit(std::vector<Vector3<double>>(mesh.size(), Vector3<double>{1, 2, 3}));
  }
  SUBCASE("out of range") {
    rotations.fit(std::vector<Vector3<double>>(mesh.size(), Vector3<double>{1e308, 0, 0}));
  }
  for (std::size_t v = 0; v < before.size(); ++v) {
    CHECK(rotations.quaternions()[v].w == doctest::Approx(before[v].w));
    CHECK(rotations.quaternions()[v].z == doctest::Approx(before[v].z));
  }
}

}  // namespace
}  // namespace dynmesh::testing
