/// Tracking of a template in raw scans, which have no correspondences: frame after frame of loose
/// points or depth images becomes a complete mesh of fixed connectivity.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <dynmesh/export.hpp>
#include <dynmesh/frame_report.hpp>
#include <dynmesh/frame_stream.hpp>
#include <dynmesh/quality.hpp>
#include <dynmesh/settings.hpp>
#include <dynmesh/training.hpp>
#include <dynmesh/types.hpp>
#include <span>

namespace dynmesh {

struct TrackerSettings {
  /// The number of threads that may work on a frame, including the calling thread, 1 to 256. More
  /// than one helps from about 2 000 vertices or points on. The others sleep between frames.
  /// Results are identical for any number of threads.
  Index threads = 1;
  /// Whether to estimate how far vertices may be off. The tracked frames are the same.
  bool uncertainty = false;
  /// Whether the template is sought again in a frame in which it is lost, since its quality is
  /// `ruined`: from the last frame that is not and, in at most one frame of ten, by a
  /// registration, which takes as long as `register_template`. A frame in which it stays lost is as
  /// without this.
  bool recover = false;
  /// On how many vertices of the template the iterations of a frame run. 0: "best", on at most
  /// 2 500, half of them, and as many of cloth, and then on all. Any other number: "live", on so
  /// many, from which the others follow by their shape, which is about twice as fast, with larger
  /// errors. A template that has no more vertices is tracked on all of them.
  Index resolution = 0;
};

/// Throws SettingError, which names the setting and its value.
DYNMESH_EXPORT void check_settings(const TrackerSettings& settings);

/// A scan: points of the surface in any order and of any number, in the axes and the unit of the
/// template.
template <class Real>
struct Scan {
  Points<const Real> points;  ///< (n, 3) finite
  /// (n, 3) the outward normals of the points, of any length; a normal of 0 means that it is not
  /// known, and such a point agrees with any side of the surface. Null: they are estimated from the
  /// nearest points, which takes longer than everything else, and turned to the viewpoints.
  Points<const Real> normals = {};
  /// (c, 3) the positions of the sensors, to which estimated normals turn, and of which
  /// `agreement_of_sensors` tells. Null if not known.
  Points<const Real> viewpoints = {};
  /// (n, 3) the colours of the points, in any unit, which tell how the surface slides along itself.
  /// Those of the template are learned where each vertex is first measured. Null if not known.
  Points<const Real> colours = {};
};

/// A depth image of a pinhole camera, without distortion.
struct DepthImage {
  /// The depth of the pixel in row r and column c is data[r * row_stride + c * column_stride]. It
  /// is measured along the axis of the camera, not along the ray, in the unit of the template.
  /// Where nothing was measured it is 0, NaN or infinite. Strides are given in elements.
  const float* data = nullptr;
  std::size_t height = 0;
  std::size_t width = 0;
  std::ptrdiff_t row_stride = 0;
  std::ptrdiff_t column_stride = 1;
  /// Row by row: fx, s, cx, 0, fy, cy, 0, 0, 1, in pixels. The centre of the first pixel is at 0,
  /// 0.
  std::array<double, 9> intrinsics{};
  /// Row by row: the rigid motion from the axes of the camera to those of the template. The camera
  /// looks along its +z axis, with x to the right and y down, as in OpenCV.
  std::array<double, 16> pose{};
  /// The colours of the pixels, three bytes each, row by row and packed, as those of a Scan. All
  /// images of a call have them or none has. Null if not known.
  const std::uint8_t* colours = nullptr;
};

/// What a tracker reports of a frame. `known` counts the vertices that have a measured point,
/// `filled` the others of their components, and `iterations` how often points were matched.
/// `standard_error` is the root mean square over both, and `stages.prior_weight` and
/// `stages.prior_share` say how far a training sequence is used.
struct TrackingReport : FrameReport {
  Measure measure;  ///< how the mesh lies in the scan; without points, its shares are NaN
  /// Whether the template was lost and found again; see TrackerSettings.
  bool recovered = false;
};

/// Tracks one template. Each frame is found from what was measured in it and from earlier frames.
///
/// `push`, `push_depth` and `skip` write the tracked frame to `tracked` and return its report. They
/// allocate memory.
///
/// They throw std::invalid_argument for bad input, with a message that says what is wrong, where,
/// and with which value: a coordinate that is not finite or beyond 1e18 for float or 1e200 for
/// double; a wrong number of rows; a null pointer; a stride of 0; intrinsics that are singular, a
/// pose that is not rigid, a negative depth, colours of some images only. The first scan after
/// construction or `reset` that is not empty must be where the template is: if most of its points
/// are elsewhere, it is refused with the distance; `register_template` tells where it is. Later
/// scans that are far away, and empty ones, count as frames in which nothing was observed.
///
/// If a call throws any exception, the tracker stays as it was before the call and nothing is
/// written to `tracked`. FrameStream says what threads may do. A state of a completer is refused.
template <class Real>
class DYNMESH_EXPORT Tracker : public FrameStream {
 public:
  /// `first_frame` is the template, complete and finite, in the pose of the first scan. See
  /// Completer for `faces`.
  Tracker(Faces faces, Points<const Real> first_frame, const TrackerSettings& settings = {});
  /// Copies `training`, from which the tracker learns how the shape of the subject varies. A
  /// training sequence that is of no use is not used. It throws SettingError as Completer does.
  Tracker(Faces faces, Points<const Real> first_frame, const TrackerSettings& settings,
          const Training<Real>& training);

  /// Finds the template in a scan.
  TrackingReport push(const Scan<Real>& scan, Points<Real> tracked);

  /// Finds the template in the depth images of one or several cameras of the same moment.
  TrackingReport push_depth(std::span<const DepthImage> images, Points<Real> tracked);

  /// A frame in which nothing was measured: the template stays where it is.
  TrackingReport skip(Points<Real> tracked);

  /// Makes this complete frame the new template, as if the tracker were newly constructed.
  void reset(Points<const Real> frame);

  [[nodiscard]] const TrackerSettings& settings() const;  ///< may be called at any time
  /// (k,) 1 for the vertices that have a measured point in the last frame, else 0.
  [[nodiscard]] std::span<const std::uint8_t> observed() const;
  /// (k,) the standard error of the distance of each vertex of the last frame from the true
  /// surface, in the unit of the positions: about 90 % are within 1.645 of it, fewer of
  /// cloth that is not seen. Infinite where no measured point is connected. How far a vertex is off
  /// along the surface, where nothing measured tells, is not known. Throws std::invalid_argument
  /// without `uncertainty`.
  [[nodiscard]] std::span<const Real> standard_error() const;
  /// The report of the last frame, which may be read at any time. Before the first frame, all
  /// vertices count as known.
  [[nodiscard]] TrackingReport report() const;
  /// How well the last frame explains what each sensor measured: one for each image or viewpoint,
  /// in the order of the call. A point of a scan counts for the viewpoint that its normal turns to
  /// most. Empty before the first frame and after `restore`.
  [[nodiscard]] std::span<const Agreement> agreement_of_sensors() const;
};

}  // namespace dynmesh
