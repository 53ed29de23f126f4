#include "detail/memory.hpp"

#include <algorithm>

namespace dynmesh {
ShapeMemory::ShapeMemory(std::size_t n_vertices, const DetailConstants& constants)
    : newest_(constants.newest), first_(n_vertices), shapes_(n_vertices) {}

void ShapeMemory::reset(Field first, double mean_edge) {
  std::ranges::copy(first, first_.begin());
  mean_edge_ = mean_edge;
  for (std::size_t v = 0; v < first.size(); ++v) shapes_[v] = {first[v], {}, {}};
}

void ShapeMemory::learn(Field detail, Workers& workers) {
  workers.for_each_in_chunks(detail.size(), [&](std::size_t v) {
    const auto newest_change = detail[v] - shapes_[v].last;
    // A jump by a mean edge length or more is considered an error, and u is reset.
    const bool is_jump = !(squared_norm(newest_change) < mean_edge_ * mean_edge_);
    const auto mean = (1 - newest_) * shapes_[v].change + newest_ * newest_change;
    shapes_[v] = {detail[v], first_[v] - detail[v], is_jump ? Vector3<double>{} : mean};
  });
}

void ShapeMemory::recall(Field detail) {
  for (std::size_t v = 0; v < detail.size(); ++v) {
    shapes_[v].last = detail[v];
    shapes_[v].to_rest = first_[v] - detail[v];
  }
}

}  // namespace dynmesh
