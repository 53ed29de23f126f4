/// Completion of a dynamic mesh, one frame at a time.
#pragma once

#include <dynmesh/export.hpp>
#include <dynmesh/frame_report.hpp>
#include <dynmesh/frame_stream.hpp>
#include <dynmesh/settings.hpp>
#include <dynmesh/training.hpp>
#include <dynmesh/types.hpp>
#include <span>

namespace dynmesh {

/// Completes the frames of one dynamic mesh in order, each from the frame itself and earlier frames
/// only.
///
/// `push`, `push_sparse` and `skip` write the completed frame to `completed` and return its report.
/// Known vertices are returned exactly as given, with two exceptions: with the setting `noise` they
/// move as well, and vertices rejected by `reject_outliers` are estimated. With method motion,
/// these functions allocate no memory; with method detail, they do when the factor of the system of
/// the frame is larger than all earlier ones.
///
/// They throw std::invalid_argument for bad input, with a message that says what is wrong, where,
/// and with which value. Bad input is: a wrong number of rows; a null pointer; a stride of 0; a
/// known position that is not finite or has a coordinate beyond 1e18 for float or 1e200 for double;
/// an index that is out of range or given twice. `completed` may be the same view as `points`, or
/// other columns of the same interleaved buffer. Output that would overwrite input in any other way
/// is refused.
///
/// Completed frames are always finite. If an estimate leaves the range above, which can only happen
/// if the recursion diverges over many frames, the vertex keeps its previous position.
///
/// If a call throws any exception, including std::bad_alloc, the completer stays as it was before
/// the call and nothing is written to `completed`.
///
/// FrameStream says what threads may do.
template <class Real>
class DYNMESH_EXPORT Completer : public FrameStream {
 public:
  /// `faces` must hold at least one face and is not needed after construction. `first_frame` must
  /// be complete: it has at least one vertex, and all of its positions are finite. Throws
  /// std::invalid_argument if these conditions are not met or if `check_settings` refuses the
  /// settings.
  Completer(Faces faces, Points<const Real> first_frame, const Settings& settings = {});
  /// With the frames of a training sequence, which method detail requires. Also throws
  /// std::invalid_argument if there are fewer than three, if they have another number of vertices,
  /// or if their root mean square distance from their centre is less than a fiftieth or more than
  /// fifty times that of `first_frame`, which means another unit of length. The frames are copied.
  Completer(Faces faces, Points<const Real> first_frame, const Settings& settings,
            const Training<Real>& training);

  /// `points` and `known` have one row for each vertex. Rows of `points` that are not known are not
  /// read.
  FrameReport push(Points<const Real> points, KnownMask known, Points<Real> completed);

  /// Rows of `points` that have a coordinate that is not finite count as missing.
  FrameReport push(Points<const Real> points, Points<Real> completed);

  /// Only the vertices `indices[i]` were observed, at the positions `points(i)`.
  FrameReport push_sparse(std::span<const Index> indices, Points<const Real> points,
                          Points<Real> completed);

  /// Completes a frame in which no vertex was observed.
  FrameReport skip(Points<Real> completed);

  /// Makes this complete frame the new frame 0, as if the completer were newly constructed.
  /// Allocates memory. Fast if it is the same frame 0, as FrameStream::restore.
  void reset(Points<const Real> frame);

  [[nodiscard]] const Settings& settings() const;  ///< may be called at any time
  /// (k,) the standard error of a coordinate of each vertex of the last frame, in the unit of the
  /// positions: the true position is within 2.5 standard errors for about 90 % of the vertices that
  /// were estimated, and within 1.54 for half of them. 0 for exact anchors and before the first
  /// frame, infinity for disconnected vertices. Throws std::invalid_argument without the setting
  /// `uncertainty`.
  [[nodiscard]] std::span<const Real> standard_error() const;
  /// The report of the last frame, which may be read at any time. Before the first frame, all
  /// vertices count as known.
  [[nodiscard]] FrameReport report() const;
};

}  // namespace dynmesh
