#include "detail/rotations.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <utility>

#include "support/geometry.hpp"

namespace dynmesh {
Rotations::Rotations(const Cells& cells, Workers& workers, const RotationKernels& kernels)
    : cells_(cells),
      workers_(workers),
      kernels_(kernels),
      turning_(best_kernels().products),
      rest_edges_(cells.neighbours.size()),
      covariances_(cells.size()),
      quaternions_(cells.size()) {}

Rotations::Prepared Rotations::prepare(std::span<const Vector3<double>> first_frame) const {
  Clusters clusters = cluster_vertices(cells_, first_frame);
  const std::size_t n = clusters.size();
  return {std::move(clusters), std::vector<Covariance>(n), std::vector<Covariance>(n),
          std::vector<Quaternion>(n), std::vector<Index>(n + 1)};
}

void Rotations::reset(Prepared prepared, std::span<const Vector3<double>> first_frame,
                      double mean_edge) noexcept {
  wide_ = std::move(prepared);
  std::size_t half_edge = 0;
  for (std::size_t i = 0; i < cells_.size(); ++i) {
    for (const Index j : cells_[static_cast<Index>(i)]) {
      const auto edge = (1 / mean_edge) * first_frame[static_cast<std::size_t>(j)] -
                        (1 / mean_edge) * first_frame[i];
      rest_edges_[half_edge++] = (1 / std::max(squared_norm(edge), squared_length_floor)) * edge;
    }
  }
  std::ranges::fill(quaternions_, Quaternion{1, 0, 0, 0});
}

RotationData Rotations::data(std::span<const Vector3<double>> frame) {
  return {cells_.offsets.data(), cells_.neighbours.data(), rest_edges_.data(),
          frame.data(),          covariances_.data(),      quaternions_.data()};
}

void Rotations::measure(std::span<const Vector3<double>> frame) {
  workers_.for_each_short_chunk(static_cast<Index>(cells_.size()), [&](Index first, Index last) {
    kernels_.measure(data(frame), first, last);
  });
}

void Rotations::fit_narrowly(std::span<const Vector3<double>> frame) {
  measure(frame);
  workers_.for_each_short_chunk(static_cast<Index>(cells_.size()), [&](Index first, Index last) {
    kernels_.turn(data(frame), first, last);
  });
}

void Rotations::fit_widely(std::span<const Vector3<double>> frame) {
  measure(frame);
  const auto for_each_cluster = [&](const auto& work) {
    constexpr Index vertices = 7;  // of most clusters
    workers_.for_each_short_chunk(static_cast<Index>(wide_.clusters.size()), work, vertices);
  };
  const auto add_up = [&](const std::vector<Covariance>& from, const Cells& lists, bool with_own,
                          std::vector<Covariance>& sums) {
    for_each_cluster([&](Index first, Index last) {
      kernels_.add_lists(from.data(), lists.offsets.data(), lists.neighbours.data(), with_own,
                         sums.data(), first, last);
    });
  };
  add_up(covariances_, wide_.clusters.members, false, wide_.covariances);
  for (int n = 0; n < 2; ++n) {
    add_up(wide_.covariances, wide_.clusters.neighbours, true, wide_.averaged);
    std::swap(wide_.covariances, wide_.averaged);
  }
  for (std::size_t c = 0; c < wide_.clusters.size(); ++c) {
    wide_.quaternions[c] = quaternions_[static_cast<std::size_t>(wide_.clusters.centres[c])];
  }
  RotationData of_clusters = data(frame);
  of_clusters.cell_offsets = wide_.no_cells.data();
  of_clusters.covariances = wide_.covariances.data();
  of_clusters.quaternions = wide_.quaternions.data();
  for_each_cluster([&](Index first, Index last) { kernels_.turn(of_clusters, first, last); });
  workers_.for_each_short_chunk(static_cast<Index>(cells_.size()), [&](Index first, Index last) {
    kernels_.blend(data(frame), wide_.clusters.of_vertex.data(), wide_.quaternions.data(), first,
                   last);
  });
}

double Rotations::mean_angle_between_clusters() const {
  double sum = 0;
  for (std::size_t c = 0; c < wide_.clusters.size(); ++c) {
    const Quaternion& a = wide_.quaternions[c];
    for (const Index j : wide_.clusters.neighbours[static_cast<Index>(c)]) {
      const Quaternion& b = wide_.quaternions[static_cast<std::size_t>(j)];
      const double cosine = std::abs(a.w * b.w + a.x * b.x + a.y * b.y + a.z * b.z);
      sum += 2 * std::acos(std::min(cosine, 1.0));
    }
  }
  const std::size_t n_pairs = wide_.clusters.neighbours.neighbours.size();
  return n_pairs == 0 ? 0 : sum / static_cast<double>(n_pairs) * 180 / std::numbers::pi;
}

void Rotations::turn(std::span<const Vector3<double>> field,
                     std::span<Vector3<double>> turned) const {
  workers_.for_each_short_chunk(static_cast<Index>(cells_.size()), [&](Index first, Index last) {
    turning_.turn(quaternions_.data(), field.data(), 1, turned.data(), first, last);
  });
}

void Rotations::turn(std::span<const ShapeTerms> terms, std::span<ShapeTerms> turned) const {
  workers_.for_each_short_chunk(static_cast<Index>(cells_.size()), [&](Index first, Index last) {
    turning_.turn(quaternions_.data(), side_by_side(terms).data(), 3, side_by_side(turned).data(),
                  first, last);
  });
}

void Rotations::turn_back(std::span<const Vector3<double>> field,
                          std::span<Vector3<double>> turned) const {
  workers_.for_each_short_chunk(static_cast<Index>(cells_.size()), [&](Index first, Index last) {
    turning_.turn_back(quaternions_.data(), field.data(), turned.data(), first, last);
  });
}

}  // namespace dynmesh
