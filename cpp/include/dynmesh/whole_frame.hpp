/// A whole frame, put together from frames none of which need be whole.
#pragma once

#include <cstddef>
#include <cstdint>
#include <dynmesh/export.hpp>
#include <dynmesh/types.hpp>
#include <functional>
#include <optional>
#include <span>
#include <vector>

namespace dynmesh {

/// The whole frame that `whole_frame` puts together. Arrays have a row for each vertex.
template <class Real>
struct WholeFrame {
  std::vector<Real> positions;  ///< x, y, z of each vertex
  /// 1 if the frame itself knows the vertex, without outliers if they are left out, 0 if not.
  std::vector<std::uint8_t> known;
  std::vector<std::uint8_t> seen;    ///< 1 if the vertex is known in at least one frame, this one
                                     ///< included, and 0 if not
  std::vector<Real> standard_error;  ///< of a coordinate, as in Completer::standard_error: 0 where
                                     ///< the frame knows the vertex exactly, infinity where nothing
                                     ///< ties it to a known vertex
  std::size_t frame = 0;             ///< the number of the frame that was made whole
  /// Whether the result is probably wrong: its edges are far from the lengths that they have where
  /// frames know both of their ends. The frames may not belong together.
  bool doubtful = false;
};

struct WholeFrameSettings {
  /// The frame to be made whole. If it is not set, the one that knows most vertices; of several,
  /// that nearest to the middle, which can learn from both sides.
  std::optional<std::size_t> frame = std::nullopt;
  /// The standard deviation of the noise of known positions, positive and in their unit. With it,
  /// known vertices of the frame are smoothed by what other frames know of them. If it is not set,
  /// they come back exactly as given.
  std::optional<double> noise = std::nullopt;
  /// Whether known positions that contradict the lengths of the edges around them, as other frames
  /// know them, count as missing in every frame.
  bool outliers = false;
  /// The number of threads that may work, as in Settings::threads.
  Index threads = 1;
};

/// Writes the positions of frame `frame` to `points` and 1 to `known` where they were observed, 0
/// elsewhere. Both have a row for each vertex. Rows that are not known are not read.
template <class Real>
using FrameSource =
    std::function<void(std::size_t frame, Points<Real> points, std::span<std::uint8_t> known)>;

/// Called with the steps that are done and their number, which grows if a second attempt is needed.
using Progress = std::function<void(std::size_t done, std::size_t of)>;

/// Puts a whole frame together, from which a completer can start. A completer is sent out from a
/// smooth surface through the known vertices of the frame to both ends of the sequence and back,
/// five times or more, each time from a frame that the last trip has made better; then, the results
/// of both sides are averaged by their standard errors. See docs/method.md.
///
/// The mesh has `n_vertices` vertices; `faces` must hold at least one face. `source` is called for
/// all `n_frames` frames in ascending order, and then once more, in ascending order, for those that
/// are used: all up to 250, otherwise the nearest thirty on each side and then fewer and fewer.
/// These are kept, at most 300 frames and a completer. The time is that of about ten frames of a
/// completer with `learn` and `uncertainty` for each of them.
///
/// Throws std::invalid_argument if the mesh or a setting is refused, if there is no such frame, if
/// a known position is out of range, or if no vertex is known in any of the frames that are used.
/// What `source` and `progress` throw is passed on, so both can stop the work.
template <class Real>
DYNMESH_EXPORT WholeFrame<Real> whole_frame(Faces faces, std::size_t n_vertices,
                                            std::size_t n_frames, const FrameSource<Real>& source,
                                            const WholeFrameSettings& settings = {},
                                            const Progress& progress = {});

}  // namespace dynmesh
