#include "shape/rotations.hpp"

#include <algorithm>
#include <utility>

namespace dynmesh {
namespace {

void turn_fields(std::span<const Quaternion> q, bool back, Field field, int fields,
                 std::span<Vector3> turned, Workers& workers) {
  workers.for_each_short_chunk(static_cast<Index>(q.size()), [&](Index first, Index last) {
    best_kernels().rotations.turn(q.data(), back, field.data(), fields, turned.data(), first, last);
  });
}

}  // namespace

void turn(std::span<const Quaternion> q, Field field, std::span<Vector3> turned, Workers& workers) {
  turn_fields(q, false, field, 1, turned, workers);
}
void turn(std::span<const Quaternion> q, std::span<const ShapeTerms> terms,
          std::span<ShapeTerms> turned, Workers& workers) {
  turn_fields(q, false, side_by_side(terms), 3, side_by_side(turned), workers);
}
void turn_back(std::span<const Quaternion> q, Field field, std::span<Vector3> turned,
               Workers& workers) {
  turn_fields(q, true, field, 1, turned, workers);
}

// Each position has one rest edge in a cluster: the sum of the weighted edges, each divided by its
// squared length, of the cells of its members that end at this position, minus those that start
// there. These add up to zero, so that all may start at the centre.
Surroundings::Surroundings(const Cells& cells, Field first_frame, double mean_edge)
    : clusters(cluster_vertices(cells, first_frame)) {
  std::vector<Index> place(cells.size(), none);
  for (Index c = 0; c < static_cast<Index>(clusters.size()); ++c) {
    const auto rest_of = [&](Index v) -> Vector3& {
      if (place[v] < ends.offsets.back()) {
        place[v] = static_cast<Index>(rest_edges.size());
        ends.neighbours.push_back(v);
        rest_edges.emplace_back();
      }
      return rest_edges[place[v]];
    };
    for (const Index i : clusters.members[c]) {
      for (const Index j : cells[i]) {
        const auto edge = (1 / mean_edge) * first_frame[j] - (1 / mean_edge) * first_frame[i];
        const auto rest = (1 / std::max(squared_norm(edge), squared_length_floor)) * edge;
        rest_of(j) = rest_of(j) + rest;
        rest_of(i) = rest_of(i) - rest;
      }
    }
    ends.offsets.push_back(static_cast<Index>(rest_edges.size()));
  }
}

Rotations::Rotations(const Surroundings& surroundings, Workers& workers)
    : surroundings_(surroundings),
      workers_(workers),
      sums_(surroundings.clusters.size()),
      averaged_(sums_.size()),
      turns_(sums_.size()) {}

void Rotations::fit(Field frame, std::span<Quaternion> q) {
  const Clusters& clusters = surroundings_.clusters;
  const Cells& ends = surroundings_.ends;
  const auto& rest_edges = surroundings_.rest_edges;
  const RotationKernels& kernels = best_kernels().rotations;
  const auto for_each_cluster = [&](const auto& work) {
    workers_.for_each_short_chunk(static_cast<Index>(clusters.size()), work,
                                  Clusters::typical_size);
  };
  const RotationData edges = {ends.offsets.data(),     ends.neighbours.data(), rest_edges.data(),
                              clusters.centres.data(), frame.data(),           sums_.data()};
  for_each_cluster([&](Index first, Index last) { kernels.measure(edges, first, last); });
  for (int n = 0; n < 2; ++n) {
    const Cells& beside = clusters.neighbours;
    for_each_cluster([&](Index first, Index last) {
      kernels.add_lists(sums_.data(), beside.offsets.data(), beside.neighbours.data(),
                        averaged_.data(), first, last);
    });
    std::swap(sums_, averaged_);
  }
  for (std::size_t c = 0; c < clusters.size(); ++c) {
    turns_[c] = q[clusters.centres[c]];
  }
  for_each_cluster(
      [&](Index first, Index last) { kernels.fit(sums_.data(), turns_.data(), first, last); });
  blend(turns_, q);
}

void Rotations::blend(std::span<const Quaternion> of_clusters,
                      std::span<Quaternion> of_vertices) const {
  const Clusters& clusters = surroundings_.clusters;
  const OperatorData weights = {clusters.weights.outerIndexPtr(), clusters.weights.innerIndexPtr(),
                                clusters.weights.valuePtr(), nullptr};
  workers_.for_each_short_chunk(
      static_cast<Index>(of_vertices.size()), [&](Index first, Index last) {
        best_kernels().rotations.blend(weights, clusters.of_vertex.data(), of_clusters.data(),
                                       of_vertices.data(), first, last);
      });
}

void Rotations::turn_further(std::span<const Quaternion> of_clusters, std::span<const Quaternion> q,
                             std::span<Quaternion> turned) {
  blend(of_clusters, turned);
  workers_.for_each_in_chunks(q.size(),
                              [&](std::size_t v) { turned[v] = product(turned[v], q[v]); });
}

}  // namespace dynmesh
