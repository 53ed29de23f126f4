/// The frames that whole_frame uses.
#pragma once

#include <cstddef>
#include <cstdint>
#include <dynmesh/types.hpp>
#include <vector>

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
  [[nodiscard]] Vector3<double> position(std::size_t frame, Index vertex) const {
    const Real* row = positions[frame].data() + 3 * static_cast<std::size_t>(vertex);
    return {static_cast<double>(row[0]), static_cast<double>(row[1]), static_cast<double>(row[2])};
  }
};

/// The indices of the frames of one side of a window, from the nearest to the farthest.
enum class Side { before, after };
template <class Real>
std::vector<std::size_t> frames_of(const Window<Real>& window, Side side) {
  std::vector<std::size_t> frames;
  if (side == Side::before) {
    for (std::size_t i = window.base; i > 0; --i) frames.push_back(i - 1);
  } else {
    for (std::size_t i = window.base + 1; i < window.size(); ++i) frames.push_back(i);
  }
  return frames;
}

}  // namespace dynmesh
