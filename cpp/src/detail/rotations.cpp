#include "detail/rotations.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <functional>
#include <numeric>
#include <tuple>
#include <utility>

#include "support/geometry.hpp"
#include "support/stored_numbers.hpp"

namespace dynmesh {
namespace {

/// The order in which vertices may become centres. Distances are rounded, since the order of a sum
/// over all vertices affects the mean.
std::vector<Index> in_order(std::span<const Vector3<double>> positions) {
  constexpr double steps = 1 << 20;
  Vector3<double> mean;
  for (const auto& position : positions) mean = mean + position;
  mean = (1 / static_cast<double>(positions.size())) * mean;
  std::vector<double> distances(positions.size());
  double largest = 0;
  for (std::size_t v = 0; v < distances.size(); ++v) {
    distances[v] = std::sqrt(squared_norm(positions[v] - mean));
    largest = std::max(largest, distances[v]);
  }
  if (largest > 0) {
    for (double& distance : distances) distance = std::round(distance / largest * steps);
  }
  std::vector<Index> order(positions.size());
  std::iota(order.begin(), order.end(), Index{0});
  std::ranges::sort(order, std::less{}, [&](Index v) {
    const Vector3<double>& p = positions[v];
    return std::tuple(-distances[v], p.x, p.y, p.z, v);
  });
  return order;
}

}  // namespace

Clusters cluster_vertices(const Cells& cells, std::span<const Vector3<double>> positions) {
  const auto k = static_cast<Index>(cells.size());
  Clusters clusters;
  std::vector<Index> cell_of(at(k), none);
  const std::vector<Index> order = in_order(positions);
  for (const Index v : order) {
    const auto is_taken = [&](Index j) { return cell_of[j] != none; };
    if (is_taken(v) || std::ranges::any_of(cells[v], is_taken)) continue;
    cell_of[v] = static_cast<Index>(clusters.size());
    clusters.centres.push_back(v);
    for (const Index j : cells[v]) cell_of[j] = cell_of[v];
  }
  clusters.of_vertex = cell_of;
  for (Index v = 0; v < k; ++v) {
    if (cell_of[v] != none) continue;
    // A neighbour is in a cell, otherwise this vertex would be a centre. Of several clusters, the
    // first one.
    Index first = static_cast<Index>(clusters.size());
    for (const Index j : cells[v]) {
      if (cell_of[j] != none) first = std::min(first, cell_of[j]);
    }
    clusters.of_vertex[v] = first;
  }
  clusters.members = lists_by_key(clusters.size(), [&](const auto& visit) {
    for (Index v = 0; v < k; ++v) visit(clusters.of_vertex[v], v);
  });
  std::vector<Index> last_visitor(clusters.size());
  clusters.neighbours = lists_by_key(clusters.size(), [&](const auto& visit) {
    std::ranges::fill(last_visitor, none);
    for (Index c = 0; c < static_cast<Index>(clusters.size()); ++c) {
      last_visitor[c] = c;
      for (const Index v : clusters.members[c]) {
        for (const Index j : cells[v]) {
          const Index other = clusters.of_vertex[j];
          if (last_visitor[other] == c) continue;
          last_visitor[other] = c;
          visit(c, other);
        }
      }
    }
  });
  return clusters;
}

Rotations::Rotations(const Cells& cells, Workers& workers,
                     std::span<const Vector3<double>> first_frame, double mean_edge)
    : cells_(cells),
      workers_(workers),
      rest_edges_(cells.neighbours.size()),
      covariances_(cells.size()),
      quaternions_(cells.size(), Quaternion{1, 0, 0, 0}),
      clusters_(cluster_vertices(cells, first_frame)),
      sums_(clusters_.size()),
      averaged_(clusters_.size()),
      turns_(clusters_.size()) {
  std::size_t half_edge = 0;
  for (std::size_t i = 0; i < cells_.size(); ++i) {
    for (const Index j : cells_[i]) {
      const auto edge = (1 / mean_edge) * first_frame[j] - (1 / mean_edge) * first_frame[i];
      rest_edges_[half_edge++] = (1 / std::max(squared_norm(edge), squared_length_floor)) * edge;
    }
  }
}

RotationData Rotations::data(std::span<const Vector3<double>> frame) {
  return {cells_.offsets.data(), cells_.neighbours.data(), rest_edges_.data(),
          frame.data(),          covariances_.data(),      quaternions_.data()};
}

void Rotations::fit(std::span<const Vector3<double>> frame) {
  const RotationKernels& kernels = best_kernels().rotations;
  workers_.for_each_short_chunk(static_cast<Index>(cells_.size()), [&](Index first, Index last) {
    kernels.measure(data(frame), first, last);
  });
  const auto for_each_cluster = [&](const auto& work) {
    constexpr Index vertices = 7;  // of most clusters
    workers_.for_each_short_chunk(static_cast<Index>(clusters_.size()), work, vertices);
  };
  const auto add_up = [&](const std::vector<Covariance>& from, const Cells& lists, bool with_own,
                          std::vector<Covariance>& sums) {
    for_each_cluster([&](Index first, Index last) {
      kernels.add_lists(from.data(), lists.offsets.data(), lists.neighbours.data(), with_own,
                        sums.data(), first, last);
    });
  };
  add_up(covariances_, clusters_.members, false, sums_);
  for (int n = 0; n < 2; ++n) {
    add_up(sums_, clusters_.neighbours, true, averaged_);
    std::swap(sums_, averaged_);
  }
  for (std::size_t c = 0; c < clusters_.size(); ++c) {
    turns_[c] = quaternions_[clusters_.centres[c]];
  }
  for_each_cluster(
      [&](Index first, Index last) { kernels.fit(sums_.data(), turns_.data(), first, last); });
  workers_.for_each_short_chunk(static_cast<Index>(cells_.size()), [&](Index first, Index last) {
    kernels.blend(data(frame), clusters_.of_vertex.data(), turns_.data(), first, last);
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
  workers_.for_each_short_chunk(static_cast<Index>(cells_.size()), [&](Index first, Index last) {
    best_kernels().rotations.turn(quaternions_.data(), back, field.data(), fields, turned.data(),
                                  first, last);
  });
}

}  // namespace dynmesh
