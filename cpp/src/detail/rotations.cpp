#include "detail/rotations.hpp"

#include <algorithm>

#include "support/geometry.hpp"

namespace dynmesh {
Rotations::Rotations(const Cells& cells, Workers& workers, const RotationKernels& kernels)
    : cells_(cells),
      workers_(workers),
      kernels_(kernels),
      turning_(best_kernels().products),
      rest_edges_(cells.neighbours.size()),
      covariances_(cells.size()),
      quaternions_(cells.size()),
      turned_(3 * cells.size()) {}

void Rotations::reset(std::span<const Vector3<double>> first_frame, double mean_edge) {
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

void Rotations::fit(std::span<const Vector3<double>> frame, int averagings) {
  const auto k = static_cast<Index>(cells_.size());
  const auto run = [&](auto kernel) {
    const RotationData data = {cells_.offsets.data(), cells_.neighbours.data(), rest_edges_.data(),
                               frame.data(),          covariances_.data(),      quaternions_.data()};
    workers_.for_each_short_chunk(k, [&](Index first, Index last) { kernel(data, first, last); });
  };
  run(kernels_.measure);
  for (int n = 1; n < averagings; ++n) average_covariances();
  run(kernels_.turn);  // which averages once
}

void Rotations::average_covariances() {
  const auto k = static_cast<Index>(cells_.size());
  workers_.for_each_short_chunk(k, [&](Index first, Index last) {
    for (Index i = first; i < last; ++i) {
      Covariance sum = covariances_[static_cast<std::size_t>(i)];
      for (const Index j : cells_[i]) {
        const Covariance& other = covariances_[static_cast<std::size_t>(j)];
        for (int c = 0; c < 3; ++c) sum.rows[c] = sum.rows[c] + other.rows[c];
      }
      averaged_[static_cast<std::size_t>(i)] = sum;
    }
  });
  std::swap(covariances_, averaged_);
}

std::span<const Vector3<double>> Rotations::turn(std::span<const Vector3<double>> triples) {
  workers_.for_each_short_chunk(static_cast<Index>(cells_.size()), [&](Index first, Index last) {
    turning_.turn(quaternions_.data(), triples.data(), 3, turned_.data(), first, last);
  });
  return turned_;
}

void Rotations::turn(std::span<const Vector3<double>> field,
                     std::span<Vector3<double>> turned) const {
  workers_.for_each_short_chunk(static_cast<Index>(cells_.size()), [&](Index first, Index last) {
    turning_.turn(quaternions_.data(), field.data(), 1, turned.data(), first, last);
  });
}

std::span<const Vector3<double>> Rotations::turn_back(std::span<const Vector3<double>> field) {
  turn_back(field, turned_);
  return {turned_.data(), cells_.size()};
}

void Rotations::turn_back(std::span<const Vector3<double>> field,
                          std::span<Vector3<double>> turned) const {
  workers_.for_each_short_chunk(static_cast<Index>(cells_.size()), [&](Index first, Index last) {
    turning_.turn_back(quaternions_.data(), field.data(), turned.data(), first, last);
  });
}

}  // namespace dynmesh
