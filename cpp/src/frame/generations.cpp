#include "frame/generations.hpp"

#include <algorithm>
#include <iterator>

namespace dynmesh {

Generations::Generations(std::size_t n_vertices)
    : generation_(n_vertices, anchor), satellites_(n_vertices), anchors_(n_vertices) {}

void Generations::classify(const Cells& cells, std::span<const std::uint8_t> known) {
  anchors_ = 0;
  for (std::size_t v = 0; v < generation_.size(); ++v) {
    generation_[v] = known[v] != 0 ? anchor : disconnected;
    anchors_ += known[v] != 0 ? 1U : 0U;
  }

  reached_ = 0;
  const auto reach = [&](Index vertex, Index iteration) {
    generation_[vertex] = iteration;
    satellites_[reached_++] = vertex;
  };
  const auto has_anchor = [&](Index v) {
    return std::ranges::any_of(cells[v], [&](Index n) { return generation_[n] == anchor; });
  };
  for (Index v = 0; v < std::ssize(generation_); ++v) {
    if (generation_[v] == disconnected && has_anchor(v)) reach(v, 1);
  }
  // Now search the cells of the satellites, in the order in which they were reached, for new ones.
  for (std::size_t i = 0; i < reached_; ++i) {
    for (const Index n : cells[satellites_[i]]) {
      if (generation_[n] == disconnected) reach(n, generation_[satellites_[i]] + 1);
    }
  }
}

}  // namespace dynmesh
