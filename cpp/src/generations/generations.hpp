/// Anchors, satellites and unseen vertices of one frame (paper, section 3, "Spatial Classification
/// of Each Frame Vertices").
#pragma once

#include <cstddef>
#include <cstdint>
#include <dynmesh/topology.hpp>
#include <dynmesh/types.hpp>
#include <span>
#include <vector>

namespace dynmesh {

/// Classifies the vertices of frame after frame. Allocates in the constructor only.
class Generations {
 public:
  static constexpr Index anchor = 0;
  static constexpr Index unseen = -1;

  /// All vertices are anchors until the first `classify`.
  explicit Generations(std::size_t n_vertices);

  /// Generation 0 for every vertex with `known[v] != 0`, g for a vertex that the g-th iteration
  /// reaches first, -1 for one that no chain of edges ties to an anchor. Each unknown vertex's cell
  /// is visited twice at most.
  void classify(const Cells& cells, std::span<const std::uint8_t> known);

  /// For an estimator that finds the generations on its way: (k,) for it to fill in, and then to
  /// say how many anchors and satellites there are. `satellites()` and `last()` are not told then.
  [[nodiscard]] std::span<Index> to_fill() { return generation_; }
  void set_counts(std::size_t anchors, std::size_t reached) {
    anchors_ = anchors;
    reached_ = reached;
  }

  /// (k,) the generation of each vertex.
  [[nodiscard]] std::span<const Index> of_vertices() const { return generation_; }

  /// The satellites, those of generation 1 first.
  [[nodiscard]] std::span<const Index> satellites() const {
    return {satellites_.data(), reached_by(last())};
  }

  /// T, the largest generation; 0 where nothing was to be reached.
  [[nodiscard]] Index last() const { return static_cast<Index>(ends_.size()) - 1; }

  /// How many satellites the iterations up to `iteration` reach: the first so many of
  /// `satellites()` are of that generation or an earlier one.
  [[nodiscard]] std::size_t reached_by(Index iteration) const {
    return ends_[static_cast<std::size_t>(iteration < last() ? iteration : last())];
  }

  [[nodiscard]] std::size_t anchors() const { return anchors_; }
  [[nodiscard]] std::size_t reached() const { return reached_; }
  [[nodiscard]] std::size_t unseen_vertices() const {
    return generation_.size() - anchors_ - reached_;
  }

 private:
  void reach(Index vertex, Index iteration);

  std::vector<Index> generation_;
  std::vector<Index> satellites_;
  std::vector<std::size_t> ends_;  // ends_[g]: end of generation g in satellites_
  std::size_t reached_ = 0;
  std::size_t anchors_ = 0;
};

}  // namespace dynmesh
