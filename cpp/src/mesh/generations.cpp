#include "mesh/generations.hpp"

#include <algorithm>

namespace dynmesh {

Generations::Generations(std::size_t n_vertices)
    : generation_(n_vertices, anchor), satellites_(n_vertices), anchors_(n_vertices) {
  ends_.reserve(n_vertices + 1);
  ends_.push_back(0);
}

void Generations::reach(Index vertex, Index iteration) {
  generation_[vertex] = iteration;
  satellites_[reached_++] = vertex;
}

void Generations::classify(const Cells& cells, std::span<const std::uint8_t> known) {
  anchors_ = 0;
  for (std::size_t v = 0; v < generation_.size(); ++v) {
    generation_[v] = known[v] != 0 ? anchor : disconnected;
    anchors_ += known[v] != 0 ? 1U : 0U;
  }

  reached_ = 0;
  ends_.assign(1, 0);
  const auto has_anchor = [&](Index v) {
    return std::ranges::any_of(cells[v], [&](Index n) { return generation_[n] == anchor; });
  };
  for (std::size_t v = 0; v < generation_.size(); ++v) {
    const auto vertex = static_cast<Index>(v);
    if (generation_[v] == disconnected && has_anchor(vertex)) reach(vertex, 1);
  }

  // Now search the cells of the last generation for new satellites.
  for (Index iteration = 2; reached_ > ends_.back(); ++iteration) {
    const std::size_t first = ends_.back();
    const std::size_t last = reached_;
    ends_.push_back(last);
    for (std::size_t i = first; i < last; ++i) {
      for (const Index n : cells[satellites_[i]]) {
        if (generation_[n] == disconnected) reach(n, iteration);
      }
    }
  }
}

}  // namespace dynmesh
