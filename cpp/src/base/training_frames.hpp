/// The frames of a training sequence.
#pragma once

#include <cmath>
#include <cstddef>
#include <dynmesh/settings.hpp>
#include <dynmesh/training.hpp>
#include <dynmesh/types.hpp>
#include <vector>

#include "base/checks.hpp"
#include "base/geometry.hpp"

namespace dynmesh {

/// The frames of a training sequence, each (k,).
using TrainingFrames = std::vector<std::vector<Vector3>>;

/// The root mean square distance of the vertices from their mean, which does not depend on their
/// order or on how they are turned.
inline double spread_of(Field frame) {
  const double share = 1 / static_cast<double>(frame.size());
  Vector3 mean;
  for (const auto& x : frame) mean = mean + share * x;
  double square = 0;
  for (const auto& x : frame) square += share * squared_norm(x - mean);
  return std::sqrt(square);
}

/// The frames of a training sequence for a mesh with this frame 0. Throws SettingError for one of
/// another mesh, of too few frames, or in another unit of length, such as millimetres for metres.
/// One whose size differs less is useless at worst, and then it is not used.
template <class Real>
TrainingFrames frames_of(const Training<Real>& training, Field first_frame) {
  if (training.n_vertices() != first_frame.size()) {
    throw SettingError("training", joined("its frames have ", training.n_vertices(),
                                          " vertices, but first_frame has ", first_frame.size()));
  }
  if (training.n_added() < Training<Real>::fewest_frames) {
    throw SettingError("training",
                       joined("has ", training.n_added(), " frames, but at least 3 are needed"));
  }
  constexpr double most = 50;
  TrainingFrames frames;
  double trained = 0;
  for (const auto& positions : training.frames()) {
    const Points<const Real> rows(positions.data(), first_frame.size());
    auto& frame = frames.emplace_back();
    for (std::size_t v = 0; v < rows.count; ++v) frame.push_back(row(rows, v));
    trained += spread_of(frame) / static_cast<double>(training.frames().size());
  }
  const double size = spread_of(first_frame);
  if (trained <= most * size && size <= most * trained) return frames;
  throw SettingError("training",
                     joined("its size, the root mean square distance from the centre, is ",
                            to_text(trained, 4), ", but that of first_frame is ", to_text(size, 4),
                            "; both must be in the same unit of length"));
}

}  // namespace dynmesh
