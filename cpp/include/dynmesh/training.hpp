/// A training sequence: complete frames of the subject, seen before.
#pragma once

#include <cstddef>
#include <dynmesh/export.hpp>
#include <dynmesh/types.hpp>
#include <span>
#include <vector>

namespace dynmesh {

/// Complete frames of the same mesh, for example of a range-of-motion recording, an earlier
/// recording or the animation of a template. From them, method detail learns how the shape of the
/// subject varies. Where the subject is and how it is turned does not matter, but the unit of
/// length does. Frames of other subjects, and mirror images of a closed mesh, have no effect.
///
/// Of many frames, only some are kept, at regular intervals: every frame up to 75, then every
/// second one, and so on. Frames of several training sequences can be added one after another.
template <class Real>
class DYNMESH_EXPORT Training {
 public:
  static constexpr std::size_t fewest_frames = 3;  ///< that a completer needs
  static constexpr std::size_t most_frames = 75;   ///< that are kept

  explicit Training(std::size_t n_vertices);

  /// Adds a frame with a row for each vertex. Throws std::invalid_argument for a wrong number of
  /// rows and for positions that are not finite or too large; then nothing has changed.
  void add(Points<const Real> frame);

  [[nodiscard]] std::size_t n_vertices() const { return n_vertices_; }
  /// The number of frames that were added.
  [[nodiscard]] std::size_t n_added() const { return n_added_; }
  /// The frames that are kept, x y z of each vertex.
  [[nodiscard]] std::span<const std::vector<Real>> frames() const { return frames_; }

 private:
  std::size_t n_vertices_;
  std::size_t n_added_ = 0;
  std::size_t interval_ = 1;
  std::vector<std::vector<Real>> frames_;
};

}  // namespace dynmesh
