/// The frames that whole_frame uses.
#pragma once

#include <cstddef>
#include <cstdint>
#include <dynmesh/types.hpp>
#include <vector>

#include "base/geometry.hpp"

namespace dynmesh {

/// Some frames of a sequence, with what they know. Positions are those of the caller, so the rows
/// of vertices that are not known are arbitrary.
template <class Real>
struct Window {
  std::size_t n_vertices = 0;
  std::vector<std::size_t> numbers;              ///< of the frames in the sequence, ascending
  std::size_t base = 0;                          ///< the index of the frame to be made whole
  std::vector<std::vector<Real>> positions;      ///< x, y, z of each vertex
  std::vector<std::vector<std::uint8_t>> known;  ///< 1 or 0 for each vertex

  [[nodiscard]] std::size_t size() const { return numbers.size(); }
  [[nodiscard]] Points<const Real> points(std::size_t frame) const {
    return {positions[frame].data(), n_vertices};
  }
  [[nodiscard]] bool is_known(std::size_t frame, Index vertex) const {
    return known[frame][vertex] != 0;
  }
  [[nodiscard]] Vector3 position(std::size_t frame, Index vertex) const {
    return row(points(frame), at(vertex));
  }
  /// (k,) 1 for the vertices that at least one of these frames knows.
  template <class Frames>
  [[nodiscard]] std::vector<std::uint8_t> seen_in(const Frames& frames) const {
    std::vector<std::uint8_t> seen(n_vertices);
    for (const std::size_t frame : frames) {
      for (std::size_t v = 0; v < n_vertices; ++v) seen[v] |= known[frame][v];
    }
    return seen;
  }
};

}  // namespace dynmesh
