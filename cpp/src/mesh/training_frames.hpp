/// The frames of a training sequence, as a completer and a tracker keep them.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "mesh/numbering.hpp"
#include "support/geometry.hpp"
#include "support/stored_numbers.hpp"

namespace dynmesh {

/// Frames of the same mesh, each (k,).
using TrainingFrames = std::vector<std::vector<Vector3<double>>>;

/// Brings frames, x y z of each vertex in the caller's order, into the internal order.
template <class Real>
TrainingFrames take_in_internal_order(std::span<const std::vector<Real>> frames,
                                      const Numbering& numbering) {
  TrainingFrames training;
  training.reserve(frames.size());
  for (const auto& positions : frames) {
    auto& frame = training.emplace_back(positions.size() / 3);
    for (std::size_t v = 0; v < frame.size(); ++v) {
      frame[numbering.internal_index(v)] =
          in_double(Vector3<Real>{positions[3 * v], positions[3 * v + 1], positions[3 * v + 2]});
    }
  }
  return training;
}

/// A hash of the frames, by which a state recognises its training sequence; 0 without frames.
template <class Real>
std::uint64_t hash_of_frames(std::span<const std::vector<Real>> frames) {
  std::uint64_t hash = 0;
  for (const auto& positions : frames) {
    hash = hash * 31 + (hash_of(std::as_bytes(std::span(positions))) | 1);
  }
  return hash;
}

}  // namespace dynmesh
