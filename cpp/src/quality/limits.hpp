/// The limits by which a mesh in a scan is judged, each of them once.
#pragma once

#include <cstddef>

namespace dynmesh {

inline constexpr struct QualityLimits {
  /// A result is doubtful if what speaks against it adds up to more than 1: the shares of the
  /// points that are unexplained and that disagree, the mean stretch of edges, the hole and the
  /// overlap, each divided by this. Wrong poses often have some of each and not much of any. Points
  /// of cloth that is tracked well disagree up to 0.12.
  double unexplained = 0.03;
  double disagreeing = 0.3;
  double stretch = 0.13;
  double hole = 0.035;
  double overlap = 0.003;
  /// At the start of a tracker, whose template is of the subject in its pose there, edges change by
  /// less, on average, and in a body that is turned by 180 degrees by 0.08; noise of a third of an
  /// edge changes them by 0.04, and makes them as much longer.
  double start_stretch = 0.06;
  double start_size = 1.06;
  /// It is ruined, and a surface that is tracked is lost, if a larger share of the points is far
  /// from it or disagrees, or if edges have changed by more.
  double ruined_far = 0.05;
  double ruined_disagreeing = 0.2;
  double ruined_stretch = 0.3;

  /// A point lies on the surface within so many mean edges, since a tracker follows fast motion
  /// with some delay, or, where the points are noisy, so many standard deviations of their noise.
  double near_edges = 0.75;
  double near_noise = 3;
  /// Normals tell a side if so many of them agree with that of a neighbour.
  double agreeing_neighbours = 0.7;

  /// Where a smaller share of the vertices has a point, the mesh is a guess.
  double hardly_seen = 0.01;
  /// Where a smaller share of the vertices is known, a completed frame is a guess.
  double hardly_known = 0.005;

  /// Noise does not explain a point that is farther from the surface than so many times the median
  /// and so many mean edges.
  double unexplained_medians = 4;
  double unexplained_edges = 0.25;
  /// A vertex is in a hole if no point is within so many mean edges or, where points are sparse, so
  /// many mean distances between them.
  double hole_edges = 1.5;
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
  /// If edges change by more, the mesh is of another subject.
  double other_subject = 0.14;
} quality_limits;

}  // namespace dynmesh
