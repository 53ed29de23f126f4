#include "shape/rotations.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "base/stored_numbers.hpp"

namespace dynmesh {

// Each position has one rest edge in a cluster: the sum of the weighted edges, each divided by its
// squared length, of the cells of its members that end at this position, minus those that start
// there. These add up to zero, so that all may start at the centre.
Rotations::Rotations(const Cells& cells, Workers& workers,
                     std::span<const Vector3<double>> first_frame, double mean_edge)
    : workers_(workers),
      clusters_(cluster_vertices(cells, first_frame)),
      quaternions_(cells.size(), Quaternion{1, 0, 0, 0}),
      sums_(clusters_.size()),
      averaged_(clusters_.size()),
      turns_(clusters_.size()),
      further_(cells.size()) {
  std::vector<Index> place(cells.size(), none);
  for (Index c = 0; c < static_cast<Index>(clusters_.size()); ++c) {
    const auto rest_of = [&](Index v) -> Vector3<double>& {
      if (place[v] < ends_.offsets.back()) {
        place[v] = static_cast<Index>(rest_edges_.size());
        ends_.neighbours.push_back(v);
        rest_edges_.emplace_back();
      }
      return rest_edges_[place[v]];
    };
    for (const Index i : clusters_.members[c]) {
      for (const Index j : cells[i]) {
        const auto edge = (1 / mean_edge) * first_frame[j] - (1 / mean_edge) * first_frame[i];
        const auto rest = (1 / std::max(squared_norm(edge), squared_length_floor)) * edge;
        rest_of(j) = rest_of(j) + rest;
        rest_of(i) = rest_of(i) - rest;
      }
    }
    ends_.offsets.push_back(static_cast<Index>(rest_edges_.size()));
  }
}

void Rotations::fit(std::span<const Vector3<double>> frame) {
  const RotationKernels& kernels = best_kernels().rotations;
  const auto for_each_cluster = [&](const auto& work) {
    workers_.for_each_short_chunk(static_cast<Index>(clusters_.size()), work,
                                  Clusters::typical_size);
  };
  const RotationData edges = {ends_.offsets.data(), ends_.neighbours.data(),
                              rest_edges_.data(),   clusters_.centres.data(),
                              frame.data(),         sums_.data()};
  for_each_cluster([&](Index first, Index last) { kernels.measure(edges, first, last); });
  for (int n = 0; n < 2; ++n) {
    const Cells& beside = clusters_.neighbours;
    for_each_cluster([&](Index first, Index last) {
      kernels.add_lists(sums_.data(), beside.offsets.data(), beside.neighbours.data(),
                        averaged_.data(), first, last);
    });
    std::swap(sums_, averaged_);
  }
  for (std::size_t c = 0; c < clusters_.size(); ++c) {
    turns_[c] = quaternions_[clusters_.centres[c]];
  }
  for_each_cluster(
      [&](Index first, Index last) { kernels.fit(sums_.data(), turns_.data(), first, last); });
  blend(turns_, quaternions_);
}

void Rotations::blend(std::span<const Quaternion> of_clusters,
                      std::span<Quaternion> of_vertices) const {
  const OperatorData weights = {clusters_.weights.outerIndexPtr(),
                                clusters_.weights.innerIndexPtr(), clusters_.weights.valuePtr(),
                                nullptr};
  workers_.for_each_short_chunk(
      static_cast<Index>(of_vertices.size()), [&](Index first, Index last) {
        best_kernels().rotations.blend(weights, clusters_.of_vertex.data(), of_clusters.data(),
                                       of_vertices.data(), first, last);
      });
}

void Rotations::turn_further(std::span<const Quaternion> of_clusters) {
  blend(of_clusters, further_);
  workers_.for_each_in_chunks(quaternions_.size(), [&](std::size_t v) {
    quaternions_[v] = product(further_[v], quaternions_[v]);
  });
}

void check_stored(std::span<const Quaternion> rotations) {
  constexpr double rounding = 1e-6;
  for (const auto& [w, x, y, z] : rotations) {
    if (std::abs(w * w + x * x + y * y + z * z - 1) <= rounding) continue;
    refuse_state("holds a rotation that is none");
  }
}

void Rotations::turn(bool back, Field field, int fields, std::span<Vector3<double>> turned) const {
  workers_.for_each_short_chunk(
      static_cast<Index>(quaternions_.size()), [&](Index first, Index last) {
        best_kernels().rotations.turn(quaternions_.data(), back, field.data(), fields,
                                      turned.data(), first, last);
      });
}

}  // namespace dynmesh
