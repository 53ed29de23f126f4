/// The numbers in method detail that are neither settings nor consequences of its equations.
#pragma once

namespace dynmesh {

/// Each value is the best of those tried, or stands on a plateau: `python -m
/// benchmarks.sensitivity` prints by how much the error changes when it is halved or doubled, and
/// docs/method.md shows it.
struct DetailConstants {
  /// Rounds of fitting Q and solving, the first of which finds the blend.
  int rounds = 3;

  /// <r1, r1> counts so many times: where the anchors hardly say anything, the shape of the last
  /// frame is the better guess, by a thousandth. A thousandth of a shape that is no shape at all
  /// would be too much, so what is added is at most that of a mean edge at every vertex.
  double caution = 1.001;
  /// <r2, r2> counts so many times. It takes a twentieth off c, so that a part that nobody sees
  /// does not go on changing for ever, and so that b comes first where both explain the same.
  double caution_of_change = 1.05;
  /// The share of the residual that c must explain to count at all; at twice this it counts in
  /// full.
  double least_explained = 0.1;

  /// How often residuals are averaged with the neighbours', which is how far a local blend looks.
  int averagings = 10;
  /// The pull of b_i towards b, in mean |r1_i|^2.
  double pull = 0.3;
  /// The bounds of b_i.
  double least_blend = -0.5;
  double largest_blend = 1.5;

  /// The share that the newest change of m has in u: part of what a frame shows is that earlier
  /// frames were wrong, and later ones average that out.
  double newest = 0.3;

  /// The floor of the area of a vertex, in mean vertex areas.
  double least_area = 0.2;
  /// The weight in C of an edge of a face with a repeated vertex, which spans no triangle.
  double bare_edge_weight = 0.05;

  /// lambda of the first frame, times the squared mean edge of frame 0, and its bounds later.
  double first_lambda = 10;
  double least_lambda = 1e-3;
  double largest_lambda = 1e3;
};

}  // namespace dynmesh
