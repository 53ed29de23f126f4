#include "registration/coarse_mesh.hpp"

#include <Eigen/Geometry>
#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>
#include <set>

#include "base/geometry.hpp"
#include "base/rigid_motion.hpp"
#include "mesh/clusters.hpp"

namespace dynmesh {
namespace {

/// The cluster of a vertex is that of the nearest centre among those of its cell, which a touching
/// limb does not have.
std::vector<Index> nearest_clusters(const Clusters& clusters, const Cells& cells, Field frame) {
  std::vector<Index> nearest = clusters.of_vertex;
  for (std::size_t v = 0; v < nearest.size(); ++v) {
    const auto distance = [&](Index cluster) {
      return squared_norm(frame[v] - frame[at(clusters.centres[at(cluster)])]);
    };
    for (const Index n : cells[static_cast<Index>(v)]) {
      const Index other = clusters.of_vertex[at(n)];
      if (distance(other) < distance(nearest[v])) nearest[v] = other;
    }
  }
  for (std::size_t c = 0; c < clusters.size(); ++c) {
    nearest[at(clusters.centres[c])] = static_cast<Index>(c);
  }
  return nearest;
}

/// The triangles where three clusters meet, once each, and the pairs of clusters that touch without
/// one, as faces with a repeated vertex.
std::vector<Triangle> faces_between(std::span<const Triangle> faces,
                                    const std::vector<Index>& of_vertex) {
  std::vector<Triangle> coarse;
  std::set<Triangle> made;
  std::set<std::array<Index, 2>> sides, touching;
  const auto pair_of = [](Index a, Index b) { return std::array{std::min(a, b), std::max(a, b)}; };
  for (const Triangle& face : faces) {
    const Triangle of = {of_vertex[at(face[0])], of_vertex[at(face[1])], of_vertex[at(face[2])]};
    Triangle sorted = of;
    std::ranges::sort(sorted);
    const bool is_triangle = sorted[0] != sorted[1] && sorted[1] != sorted[2];
    for (std::size_t s = 0; s < 3; ++s) {
      const Index a = of[s];
      const Index b = of[(s + 1) % 3];
      if (a == b) continue;
      touching.insert(pair_of(a, b));
      if (is_triangle) sides.insert(pair_of(a, b));
    }
    if (is_triangle && made.insert(sorted).second) coarse.push_back(of);
  }
  for (const auto& pair : touching) {
    if (!sides.contains(pair)) coarse.push_back({pair[0], pair[1], pair[1]});
  }
  return coarse;
}

}  // namespace

CoarseMesh coarse_mesh_of(std::span<const Triangle> faces, Field frame, std::size_t most_vertices) {
  CoarseMesh mesh;
  mesh.of_vertex.resize(frame.size());
  std::iota(mesh.of_vertex.begin(), mesh.of_vertex.end(), Index{0});
  mesh.faces.assign(faces.begin(), faces.end());
  mesh.positions.assign(frame.begin(), frame.end());
  mesh.topology = build_topology({mesh.faces.data()->data(), mesh.faces.size()}, frame.size());
  while (mesh.positions.size() > most_vertices) {
    const Cells& finer = mesh.topology.cells;
    const Clusters clusters = cluster_vertices(finer, mesh.positions);
    if (clusters.size() == mesh.positions.size()) break;
    const auto nearest = nearest_clusters(clusters, finer, mesh.positions);
    for (Index& owner : mesh.of_vertex) owner = nearest[at(owner)];
    mesh.faces = faces_between(mesh.faces, nearest);
    std::vector<Vector3> positions;
    for (const Index centre : clusters.centres) positions.push_back(mesh.positions[at(centre)]);
    mesh.positions = std::move(positions);
    if (mesh.faces.empty()) mesh.faces.push_back({0, 0, 0});
    mesh.topology =
        build_topology({mesh.faces.data()->data(), mesh.faces.size()}, mesh.positions.size());
  }
  return mesh;
}

/// Each vertex takes the mean of where the coarse vertices around it carry it; near ones count
/// more.
std::vector<Vector3> CoarseMesh::lifted(Field frame, Field x,
                                        std::span<const Quaternion> rotations) const {
  if (x.size() == frame.size()) return {x.begin(), x.end()};
  std::vector<Vector3> result(frame.size());
  for (std::size_t v = 0; v < frame.size(); ++v) {
    const Index owner = of_vertex[v];
    std::vector<Index> around = {owner};
    const auto ring = topology.cells[owner];
    around.insert(around.end(), ring.begin(), ring.end());
    const auto arm_from = [&](Index c) { return frame[v] - positions[at(c)]; };
    double reach = 0;
    for (const Index c : around) reach = std::max(reach, squared_norm(arm_from(c)));
    double total = 0;
    for (const Index c : around) {
      const auto arm = arm_from(c);
      const double nearness = reach > 0 ? 1 - std::sqrt(squared_norm(arm) / reach) : 1;
      const double weight = nearness * nearness;
      const Quaternion& q = rotations[at(c)];
      const auto turned = from_eigen(Eigen::Quaterniond(q.w, q.x, q.y, q.z) * to_eigen(arm));
      result[v] = result[v] + weight * (x[at(c)] + turned);
      total += weight;
    }
    result[v] = total > 0 ? (1 / total) * result[v] : x[at(owner)] + arm_from(owner);
  }
  return result;
}

}  // namespace dynmesh
