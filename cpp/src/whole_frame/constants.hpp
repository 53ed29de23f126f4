/// The constants of whole_frame. They were chosen by trials on recorded and simulated sequences;
/// docs/method.md describes them.
#pragma once

#include <cstddef>

namespace dynmesh {

struct WholeFrameConstants {
  /// Up to so many frames, all are used. Of more, the nearest on each side, and then with steps
  /// that grow by this factor.
  std::size_t all_frames = 250;
  std::size_t nearest_frames = 30;
  double step_growth = 1.05;

  /// A part of the mesh of which the frame knows fewer vertices than this comes from another frame.
  std::size_t fewest_known = 4;

  /// The trips to the ends of the sequence and back: at least the first number, and of a short
  /// sequence so many that they complete this number of frames, but no more than the last number.
  std::size_t trips = 5;
  std::size_t frames_of_trips = 300;
  std::size_t most_trips = 15;

  /// A pair of vertices contradicts the other frames if the logarithm of its distance is this far
  /// from their median, and this many of their spreads.
  double outlier_distance = 0.7;
  double outlier_spreads = 4;

  /// Lengths that fewer frames know say nothing of what is usual.
  std::size_t fewest_frames = 3;

  /// The standard deviation of a normal distribution in median absolute deviations, and its mean
  /// absolute deviation in standard deviations.
  double deviations_to_spread = 1.48;
  double spread_to_deviation = 0.84;

  /// The factor of the weight of a side on which the vertex was never seen.
  double never_seen = 1e-6;

  /// The result is doubtful if the logarithms of its edges deviate this many times as much as those
  /// of the frames, and by more than rounding and smoothing can explain. A second attempt replaces
  /// the first one if its deviation is less than this share, and the smooth fill replaces both
  /// unless theirs is less than this share of its own.
  double most_deviation = 3;
  double least_deviation = 0.05;
  /// It is also doubtful if the edges of the frames themselves vary by so much, which no surface
  /// does.
  double most_usual = 0.5;
  double better_deviation = 0.8;

  /// Standard errors: see `standard_errors` in trips.hpp.
  double error_scale = 0.92;
  double error_of_sides = 0.3;
  double error_near_unseen = 2;
  int farthest_unseen = 20;
  double error_of_unseen = 2.5;
  double shape_of_unseen = 0.5;
  int farthest_seen = 6;
  double shape_growth = 0.85;
};

}  // namespace dynmesh
