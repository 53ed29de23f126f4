/// How a mesh lies in a scan, and how good that is: one measure for frames and registrations.
#pragma once

#include <cstddef>
#include <dynmesh/export.hpp>
#include <limits>
#include <span>
#include <string>

namespace dynmesh {

/// How well a surface explains what was measured of it.
struct Agreement {
  /// How many points were compared. Stray points, which are far from the surface and sparser than
  /// others, are left out.
  std::size_t points = 0;
  /// The share of them that are farther than one mean edge of the template from the surface, 0 to
  /// 1; NaN without points. Up to 0.01 is usual.
  double far_share = std::numeric_limits<double>::quiet_NaN();
  /// The share that is near the surface, but whose normal is that of another one.
  double disagreeing = std::numeric_limits<double>::quiet_NaN();
  /// The root mean square distance from the surface of those that are not far, in the unit of the
  /// positions; NaN without any.
  double distance = std::numeric_limits<double>::quiet_NaN();
};

enum class Quality {
  good,      ///< nothing speaks against the mesh: `doubt` is at most 1
  doubtful,  ///< a part is probably wrong or missing, or hardly anything was measured
  /// The scan is of something else, or the pose was lost: the shape leapt in one frame, more than
  /// 15 % of the surface is contradicted, less than 30 % of it explained, or edges have changed by
  /// 30 %.
  ruined,
};

/// What is probably wrong with a mesh in a scan that is not good.
enum class Cause {
  unseen,  ///< hardly any vertex has a point
  size,    ///< the template is in another unit, or of a subject of another size
  part,    ///< the scan shows a part of the template only
  pose,    ///< the scan shows another mesh, or a pose that was not found
  place,   ///< a part of the template is wrong or was not measured
};

/// How a mesh lies in a scan.
struct DYNMESH_EXPORT Measure {
  Agreement agreement = {};
  /// The share of the points that are farther from the surface than their noise explains: four
  /// times the median distance, but at least a quarter of a mean edge. In the frame of a tracker,
  /// which follows the scans with some delay, only far points count.
  double unexplained = 0;
  /// The share of the template's area that is the largest connected piece without a point, as of a
  /// limb that was not measured, among what the sensors should see; without viewpoints, among all.
  double hole = 0;
  /// The share of the template's area where another part lies as well and faces the same way; 0 in
  /// a tracker, which does not measure it.
  double overlap = 0;
  /// By which share of their length the edges have changed, on average, beside their common growth;
  /// if it is large, the scan is of another subject.
  double stretch = 0;
  /// How many times as long as those of the template the edges are, by their median.
  double growth = 1;
  /// Of the template's surface that sensors should see, since it is measured, or faces one of them
  /// while nothing lies before it, the share that has a point within the noise of the points. If
  /// most points on it lie where it is too flat to the sensors, the share of the points on it.
  double explained = 1;
  /// What speaks against the mesh: the share of this surface that a sensor saw through, since it
  /// measured what lies behind, and the share of the points on the mesh that face the other way.
  double contradicted = 0;
  /// How much the edges have changed since the last frame of a tracker that was not lost, as
  /// `stretch`, and the share of the places where components touch that came apart since then, or
  /// together, by more than three mean edges.
  double change = 0;
  double parted = 0;
  /// The share of the points that lie on nothing of the mesh, since other things were measured as
  /// well, and their median distance from it.
  double others = 0;
  double others_distance = 0;
  /// The standard deviation of the points about their surface; 0 if hardly any vertex has several.
  double noise = 0;
  /// What speaks against the mesh, as a multiple of what a good one has at most. Either of two is
  /// more than 1 if it is not good: the share that is not explained, divided by 0.1 or by what is
  /// usual of recent frames; and the sum of what is contradicted, of the stretch and of the hole,
  /// divided by 0.05, 0.13 and 0.05. At the start of a tracker, whose template is the subject in
  /// its pose there, also the stretch divided by 0.06, and the growth by 6 %; later, growth by 6 %
  /// in one frame.
  double doubt = 0;
  /// `change`, or how far `stretch` departs from the usual one if that is less, as a multiple of
  /// the largest that the recent good frames make likely; near 1, a smaller one if the mesh bends
  /// where it bent before, and a larger one if its last shape lies nearer to the points turned. The
  /// same of `parted` if that is more and something speaks against the mesh, and of sudden growth.
  /// A pose that was lost is held by bending the mesh otherwise, or its parts by other ones.
  double leap = 0;
  /// Whether no earlier frame of the tracker was good. Its template is the subject as it is in the
  /// first scan; one that must be deformed to reach the points is another, or lies elsewhere.
  bool is_start = false;
  /// A vertex of the largest component that a tracker lost: nothing was measured where it should be
  /// seen, and nothing holds it there. -1 without any.
  double lost = -1;
  double seen = 1;  ///< the share of the vertices that have a measured point
  Quality quality = Quality::good;

  /// What tells the right one of several results for the same scan, which has the least: the share
  /// of the points that it does not explain, and the stretch. Exchanged limbs and bodies that are
  /// turned front to back may explain more of them, but by a template that is stretched twice as
  /// much.
  [[nodiscard]] double misfit() const {
    return agreement.far_share + agreement.disagreeing + stretch;
  }
  /// Whether there are points, but hardly any at the mesh.
  [[nodiscard]] bool lies_elsewhere() const;
  [[nodiscard]] Cause cause() const;
  /// Why the quality is not good, in a sentence that begins with the cause; empty if it is.
  [[nodiscard]] std::string reason() const;
};

/// How good a sequence is whose measured frames are this good. Single frames do not make it worse:
/// it is as good as the best of any three frames that follow one another, and as nine tenths of its
/// frames, of ten or fewer as all but one of them. Two frames are as good as the worse one; none
/// are good.
DYNMESH_EXPORT Quality quality_of_frames(std::span<const Quality> frames);

/// Whether so little is known of a frame that is completed, less than one in 200 vertices, that the
/// others are a guess. A sequence is doubtful if most of its frames are such.
DYNMESH_EXPORT bool is_hardly_known(std::size_t known, std::size_t n_vertices);

/// From which frame on, for three frames at least, less than 0.6 times as much is seen as in some
/// three frames in a row before; `seen` is Measure::seen of each frame. The number of frames if in
/// none.
DYNMESH_EXPORT std::size_t falling_sight(std::span<const double> seen);

}  // namespace dynmesh
