#include "detail/change_sizes.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "support/geometry.hpp"

namespace dynmesh {

template <class Work>
void ChangeSizes::for_each_vertex(Workers& workers, const Work& work) {
  workers.for_each_chunk(static_cast<Index>(sizes_.size()), [&](Index first, Index last) {
    for (Index v = first; v < last; ++v) work(static_cast<std::size_t>(v));
  });
}

void ChangeSizes::allocate(std::size_t n_vertices) {
  energies_.resize(n_vertices);
  sizes_.resize(n_vertices);
  averaged_.resize(n_vertices);
}

void ChangeSizes::reset() {
  std::ranges::fill(energies_, Energy{});
  std::ranges::fill(sizes_, 1.0);
}

void ChangeSizes::learn(std::span<Vector3<double>> energies, const DetailOperator& smoother,
                        Workers& workers) {
  for_each_vertex(workers, [&](std::size_t v) { energies[v].y /= sizes_[v] * sizes_[v]; });
  std::span<Vector3<double>> from = energies, to = averaged_;
  for (int n = 0; n < constants_.averagings; ++n) {
    apply_operator(smoother, from, 1, to, workers);
    std::swap(from, to);
  }
  for_each_vertex(workers, [&](std::size_t v) {
    energies_[v].add({from[v].x, from[v].y}, constants_.kept_of_sizes);
  });
  find(workers);
}

void ChangeSizes::find(Workers& workers) {
  Energy mean;
  for (const Energy& energy : energies_) mean.add(energy, 1);
  const double ratio = mean.found / mean.expected;
  const double prior = constants_.pull * mean.found / static_cast<double>(energies_.size());
  for_each_vertex(workers, [&](std::size_t v) {
    const auto& [found, expected] = energies_[v];
    const double size = std::sqrt((found + prior) / (ratio * expected + prior));
    const double largest = constants_.largest_size;
    sizes_[v] = std::isfinite(size) ? std::clamp(size, 1 / largest, largest) : 1;
  });
}

}  // namespace dynmesh
