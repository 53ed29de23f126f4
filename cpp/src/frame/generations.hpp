/// The anchors, satellites and disconnected vertices of a frame (paper, section 3, "Spatial
/// Classification of Each Frame Vertices").
#pragma once

#include <cstddef>
#include <cstdint>
#include <dynmesh/topology.hpp>
#include <dynmesh/types.hpp>
#include <span>
#include <vector>

namespace dynmesh {

/// Classifies the vertices of successive frames. Allocates memory only in the constructor.
class Generations {
 public:
  static constexpr Index anchor = 0;
  static constexpr Index disconnected = -1;

  /// Until the first `classify`, all vertices are anchors.
  explicit Generations(std::size_t n_vertices);

  /// Assigns generation 0 to every vertex with `known[v] != 0`, g to a vertex that iteration g
  /// reaches first, and -1 to a vertex that is not connected to any anchor. The cell of each
  /// unknown vertex is visited at most twice.
  void classify(const Cells& cells, std::span<const std::uint8_t> known);

  /// For a method that computes the generations itself: it fills in this array (k,) and then
  /// sets the numbers of anchors and satellites. `satellites()` and `last()` are of no use in this
  /// case.
  [[nodiscard]] std::span<Index> to_fill() { return generation_; }
  void set_counts(std::size_t anchors, std::size_t reached) {
    anchors_ = anchors;
    reached_ = reached;
  }

  /// (k,) the generation of each vertex.
  [[nodiscard]] std::span<const Index> of_vertices() const { return generation_; }

  /// The satellites, those of generation 1 first.
  [[nodiscard]] std::span<const Index> satellites() const {
    return std::span(satellites_).first(reached_);
  }

  /// T, the largest generation, or 0 if there are no satellites.
  [[nodiscard]] Index last() const {
    return reached_ > 0 ? generation_[satellites_[reached_ - 1]] : 0;
  }

  [[nodiscard]] std::size_t anchors() const { return anchors_; }
  [[nodiscard]] std::size_t reached() const { return reached_; }
  [[nodiscard]] std::size_t disconnected_vertices() const {
    return generation_.size() - anchors_ - reached_;
  }

 private:
  std::vector<Index> generation_;
  std::vector<Index> satellites_;
  std::size_t reached_ = 0;
  std::size_t anchors_ = 0;
};

}  // namespace dynmesh
