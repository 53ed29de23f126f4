/// The limits by which a mesh in a scan is judged, each of them once.
#pragma once

#include <cstddef>

namespace dynmesh {

inline constexpr struct QualityLimits {
  /// The share of what sensors should see that may be without a point. Of good frames, it was at
  /// most 0.04. At its start, a tracker does not know what its sensors always miss, such as hair.
  double missing = 0.1;
  double start_missing = 0.2;
  double most_missing = 0.3;  ///< that may be usual
  /// The same of the largest piece of it, of the template's area: a limb, not the half of one.
  double hole = 0.05;
  double start_hole = 0.12;
  /// The shares that speak against a mesh, and the mean stretch of edges. Wrong poses often have
  /// some of each and not much of any, so that they are added up, each divided by this. Of good
  /// frames, 0.01 was contradicted at most.
  double contradicted = 0.05;
  double stretch = 0.13;
  /// At the start of a tracker, whose template is of the subject in its pose there, edges change by
  /// less, on average, and in a body that is turned by 180 degrees by 0.08.
  double start_stretch = 0.06;
  double start_size = 1.06;
  /// The shape leaps if edges change in a frame by more than this, and by so many times what is
  /// usual, while the stretch departs from the usual one by `leap_stretch`. Jumps of bodies change
  /// them by 0.05, where 0.02 is usual; a body that was turned by 120 degrees, and is bent instead,
  /// by 0.05 to 0.1, where 0.005 is usual, or 0.02 of noise.
  double leap = 0.035;
  double leap_times = 2.5;
  double leap_stretch = 0.03;
  /// Between these multiples, a leap is less of one if edges change where they did before, with so
  /// small a share elsewhere, and more if the last shape lies nearer to the points turned.
  double likely_leap = 0.9;
  double certain_leap = 3;
  double bent_elsewhere = 0.05;
  double still_lost = 0.5;  ///< the share of that departure down to which it stays lost
  /// The same of parts that come apart, by so many mean edges. A machine that was turned, and whose
  /// parts were drawn to other ones, did so at 0.2 to 0.7 of the places where they touch, where
  /// 0.06 is the most of joints; and a doubt of this, at least, speaks against it; against what
  /// bursts, it is 0.3.
  double parted_edges = 3;
  double parted = 0.2;
  double parted_doubt = 0.5;
  /// What was usual holds for so many mean deviations from it. For what known sensors miss, it is
  /// fewer, as they should see all of a surface: a template that slowly goes wrong misses more in
  /// each frame, and would make that usual.
  double deviations = 4;
  double missed_deviations = 2;
  /// A surface that is tracked is lost, and a result ruined, if less is explained, if more of it is
  /// contradicted, or if edges have changed by more.
  double ruined_explained = 0.3;
  double ruined_contradicted = 0.15;
  double ruined_stretch = 0.3;
  /// If a larger share of the points is far from the surface, those of one camera are suspected,
  /// and all of them tell no standard errors of a registration.
  double ruined_far = 0.05;
  /// From this doubt on, a pose that is not lost is sought elsewhere, too.
  double sought_doubt = 1.5;
  /// So many frames in a row are good until a state that was found again is the good one.
  int settled_frames = 3;

  /// A point lies on the surface within so many mean edges, since a tracker follows fast motion
  /// with some delay, or, where the points are noisy, so many standard deviations of their noise.
  double near_edges = 0.75;
  double near_noise = 3;
  /// Normals tell a side if so many of them agree with that of a neighbour.
  double agreeing_neighbours = 0.7;

  /// Points that scatter by more mean edges are no surface, and nothing is sought in them.
  double most_noise = 1.4;
  double most_noise_without_normals = 0.5;

  /// Where a smaller share of the vertices has a point, the mesh is a guess.
  double hardly_seen = 0.01;
  double elsewhere = 0.5;  ///< unless more of the points lie on nothing of it
  /// Where a smaller share of the vertices is known, a completed frame is a guess.
  double hardly_known = 0.005;

  /// Noise does not explain a point that is farther from the surface than so many times the median
  /// and so many mean edges.
  double unexplained_medians = 4;
  double unexplained_edges = 0.25;
  /// Where points are sparse, one explains what is within so many mean distances between them.
  double hole_spacings = 1.9;
  /// Vertices within a mean edge of each other whose normals agree overlap if the template has them
  /// so many mean edges apart.
  double overlap_edges = 10;

  /// A sequence is as good as its worst run of so many frames, and one in so many frames may be
  /// worse.
  std::size_t run = 3;
  std::size_t single = 10;
  /// Sight falls if the share of the vertices that have a point becomes so many times smaller.
  double falling_sight = 0.6;

  /// A mesh that became so many times as large, or as small, is probably in another unit.
  double other_size = 1.5;
  /// If more of a template has no points, or lies on another part, and few points are far, a scan
  /// shows it partially.
  double partial = 0.3;
} quality_limits;

}  // namespace dynmesh
