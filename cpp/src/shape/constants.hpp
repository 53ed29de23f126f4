/// The constants of method detail that are neither settings nor follow from its equations.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <dynmesh/types.hpp>

namespace dynmesh {

/// The constants of training.
inline constexpr struct TrainingConstants {
  /// The number of parts beside the global one.
  Index local_parts = 12;
  /// The width of the weights of a part, in typical distances between neighbouring seeds.
  double reach = 0.7;
  /// Smaller weights of a part at a vertex are dropped.
  double least_weight = 0.15;
  /// Modes that change the shape by less than this are dropped, the root mean square of a standard
  /// deviation over the part in mean edge lengths: frames that do not deform, stored in single
  /// precision, have such modes.
  double least_mode = 1e-4;

  /// The least v, the variance of the coefficients, at which the training sequence is not used, and
  /// the largest one. It is used fully from twice the least. Changes since the last frame, which
  /// are a fraction of a standard deviation, always have the least.
  double least_variance = 0.03;
  double largest_variance = 2;
  /// The share of the residuals that the modes explain, below which the training sequence is not
  /// used, and the part of that share that a frame keeps. It is used fully from twice the least
  /// share, which is also what it is taken to be at first. The share counts if anchors are exact;
  /// noise would hide it.
  double least_share = 0.2;
  double share_kept = 0.9;
  /// lambda_j is this many times sigma^2 / v for the modes of the local parts. It is sigma^2 / v
  /// for those of the global part, whose coefficients the whole surface determines.
  double caution = 4;
  /// A coefficient that the anchors do not determine is kept up to this size. No frame of a
  /// training of 75 frames has a larger one than the root of 75.
  double largest_kept = 9;
  /// The number of steps of conjugate gradients.
  int steps = 3;
  /// The fit is forgotten if a coefficient exceeds this, which only positions far out of the range
  /// of the subject cause. Coefficients of any size would not be finite in single precision.
  double largest_coefficient = 1e6;
  /// How often the known mask is averaged with the neighbours.
  int averagings = 3;

  /// The number of shapes of which modes are learned at most, and the number of frames from one
  /// that enters to the next, after which modes are made anew.
  std::size_t most_learned = 28;
  std::uint64_t learned_interval = 4;
  /// The bound of the coordinates of a shape that enters in mean edge lengths, about 1 where the
  /// surface is creased. A frame beyond it holds positions far out of the range of the subject.
  double largest_learned = 1e6;
} training_constants;

/// The constants of the error bars.
inline constexpr struct UncertaintyConstants {
  /// How often the changes of the members are averaged over the mesh.
  int smoothings = 2;
  /// The part of a change, before that, that is the same in all of a cluster, compared with the
  /// part that is each vertex's own.
  double shared_change = 0.5;
  /// The share of a change that persists to the next frame.
  double persistence = 0.75;
  /// The share of the energies of earlier frames that is kept when a frame is added: over the mesh,
  /// for the scale, and at each vertex, for the sizes.
  double kept_of_scale = 0.98;
  double kept_of_sizes = 0.9;
  /// How often energies are averaged with those of the neighbours, which determines the scale on
  /// which quiet and busy parts are told apart.
  int averagings = 4;
  /// The weight of the mean energy at a vertex, in units of that mean.
  double pull = 0.3;
  /// The largest size of changes, compared with the mean; the least one is its inverse.
  double largest_size = 10;
  /// The weight of the mean of all components where a component shows how it turns, in axes.
  double pull_of_turns = 6;
  /// Turns count by this much more: of errors about one axis, of parts that turn more or less,
  /// fewer are within 2.5 standard errors than of errors in all directions.
  double tail_of_turns = 1.3;
  /// The largest size of the noise of planes, in what their weight would say of positions; the
  /// least one is its inverse.
  double largest_noise = 100;
} uncertainty_constants;

/// The constants of the first-order steps and of their shares.
inline constexpr struct FirstOrderConstants {
  /// The lower bound of the weight of an edge, in mean weights.
  double least_weight = 0.001;

  /// In each frame, about this many anchors of each component are left out, at most this share of
  /// them.
  double left_out = 12;
  double largest_left_out = 0.05;
  /// The test moves the vertices at most this many times the mean distance between anchors from
  /// those left out.
  double rings = 1.5;
  /// A component with fewer errors, older ones counting less, shares those of all such components.
  double least_count = 12;

  /// The share of earlier sums that is kept when those of a frame are added.
  double kept = 0.9725;
  /// Smaller shares gain too little for the time that the step takes.
  double least_share = 0.3;
  /// zeta: so many standard errors of what a later step gains over the first one count as chance.
  std::array<double, 2> chances = {1, 1.5};

  /// Up to this number of mean distances of the tests, steps apply as tested; they cease after one
  /// more.
  double tested = 2;
} first_order_constants;

/// The constants of growth.
inline constexpr struct GrowthConstants {
  /// The standard deviation of normally distributed numbers, in median absolute deviations.
  double deviations = 1.4826;
  /// The number of edges whose ratios count as if they differed by the root of two times as much.
  double few = 30;
  /// Fewer edges between measured vertices, whose positions have errors, tell no size.
  std::size_t fewest_measured = 30;
  /// The number of edges of a component that are compared at most.
  std::size_t most_edges = 2000;
  /// A component that seems to have another size than in the last frame by more than this factor is
  /// given in another unit, or is another one.
  double largest_step = 2;
  /// No component is larger, compared with frame 0, or smaller than the inverse.
  double largest_size = 1000;
} growth_constants;

/// The constants of the increments of rotations.
inline constexpr struct IncrementConstants {
  /// beta.
  double coupling = 0.05;
  /// If a cluster is more steps than this from the next one with anchors, rotations also follow
  /// from positions with the last shape, which takes a further solution.
  Index near = 1;
  /// The weight that holds a cluster where nothing else does.
  double hold = 1e-7;
  /// The weight that holds a component which is led as its leader turns.
  double hold_of_led = 1e-4;
  /// Pairs that are this far from each other on the surface weigh half, in mean edges.
  double reach = 10;
  /// Shorter pairs and arms, in mean edges, weigh as if they had this length.
  double least_length = 0.01;
  /// The anchors of a component determine its rotation if they are farther from a line than this,
  /// as the root of the sum of their squares, in mean edges.
  double least_across = 0.1;
  /// The number of steps of Gauss and Newton, which end when none turns a cluster by this angle.
  int iterations = 2;
  double settled = 0.02;
  /// The number of steps of conjugate gradients in each, and the share of the first r . z at which
  /// they end.
  int steps = 12;
  double reduced = 1e-5;
} increment_constants;

/// The constants of what goes on into holes.
inline constexpr struct ContinuationConstants {
  /// What is left of a difference from ring to ring. Farther in, the solution continues differences
  /// by itself, as smoothly as it can.
  double kept_per_ring = 0.6;
  /// The largest share of a difference that is added, from this correlation of neighbouring rows
  /// on.
  double alike = 0.3;
  double largest_share = 0.4;
} continuation_constants;

/// Another value may be better on a single sequence.
inline constexpr struct DetailConstants {
  /// <r1, r1> is multiplied by this. If the anchors hardly constrain b, the shape of the last frame
  /// is the better estimate, by a thousandth. For a degenerate shape, a thousandth would be too
  /// much, so the increase is limited to that of a mean edge length at every vertex.
  double caution = 1.001;

  /// <r2, r2> is multiplied by this, which reduces c by a twentieth. As a result, a part that is
  /// never observed does not change indefinitely, and b is preferred to c if both explain the same
  /// residual.
  double caution_of_change = 1.05;

  /// The weight of the regularisation of the blend of a cluster towards b, in units of the mean
  /// over the clusters of the sum of |r1_i|^2 in them and those beside them.
  double pull = 0.15;
  /// How far b_i may be below 0 and above 1.
  double largest_excess = 0.5;

  /// The weight of the newest change of m in u. Part of an observed change is the error of earlier
  /// frames, which averaging over later frames removes.
  double newest = 0.3;
  /// The same of a row in a hole, whose change is only what was expected of it, and of one that was
  /// in a hole in the last frame, which changed since it was seen. A row is in a hole if nothing of
  /// its one-ring is known.
  double newest_in_holes = 0.4;
  double newest_after_holes = 0.2;

  /// The lower bound of the area of a vertex, in mean vertex areas.
  double least_area = 0.2;
  /// The weight in C of an edge of a face with a repeated vertex, which has no area.
  double bare_edge_weight = 0.05;

  /// lambda of the first frame, times the squared mean edge length of frame 0, and how many times
  /// smaller or larger later values may be.
  double first_lambda = 10;
  double range_of_lambda = 100;
} detail_constants;

}  // namespace dynmesh
