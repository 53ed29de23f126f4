/// The constants of registration that do not follow from its equations.
#pragma once

#include <cstddef>

#include "surface_fit/constants.hpp"

namespace dynmesh {

/// The constants of the rigid starts.
inline constexpr struct RigidStartConstants {
  /// The rotations to begin with, spread evenly (super-Fibonacci spirals, Alexa 2022).
  int rotations = 64;
  /// About so many points of the scan and places of the surface are compared, at first and at last,
  /// and how often their pairs are found each time.
  std::size_t coarse_points = 250;
  std::size_t coarse_places = 800;
  std::size_t points = 1500;
  std::size_t places = 3000;
  int steps = 10;
  /// The length of a unit normal beside positions, in mean distances from the centre.
  double normal = 0.2;
  /// The share of the pairs that is used.
  double kept = 0.8;
  /// So many starts are returned at most, of twice as many that are best at first, which differ by
  /// at least this angle, in degrees.
  std::size_t starts = 6;
  double least_angle = 15;
} rigid_start_constants;

/// The constants of the tips of limbs.
inline constexpr struct TipConstants {
  /// The number of tips of the template, and of the scan, of which some are none.
  std::size_t of_template = 6;
  std::size_t of_scan = 8;
  /// About so many points of the scan are used. Each is connected with its nearest neighbours, if
  /// they are at most so many usual distances between neighbours away and their normals have at
  /// least this cosine.
  std::size_t points = 6000;
  int neighbours = 10;
  double reach = 3;
  double least_cosine = -0.3;
  /// How many pairings are tried of all tips, and of all but one.
  int candidates = 10;
  /// About so many places of the template are compared with ten times as many points of the scan.
  std::size_t places = 100;
} tip_constants;

inline constexpr struct RegistrationConstants {
  /// A scan so many times larger or smaller than a template is in another unit.
  double other_unit = 20;
  /// How often the scale is sought, each time by the growth of the template that the last one left.
  int scalings = 3;

  /// Poses of the coarse mesh are the same if they are nearer to each other than this on average,
  /// in its mean edges, and the template follows at most so many.
  double same_pose = 0.5;
  std::size_t most_finished = 2;
  /// A landmark holds to the end if the nearest point is farther than so many usual distances
  /// between points.
  double held_spacings = 4;

  /// The weight of landmarks, and of rough ones, and the steps in which the coarse mesh is bent
  /// until they are at their positions.
  double landmark_weight = 10;
  double rough_weight = 1;
  int bending_steps = 12;

  /// The shape yields where it departs from its own more than so many times the median.
  double usual_departures = 3;

  /// How many iterations the coarse mesh takes.
  int iterations = 6;
  /// The template is drawn into the scan so often at most, until the vertices move by less than
  /// this on average, in mean edges; as an elastic body, whose limbs untwist, and from then on, or
  /// from half of the rounds, as one that yields. The weight of a point grows slowly from round to
  /// round and is, where the shape yields, so many times that of tracking, since no noise of
  /// earlier frames accumulates.
  std::size_t most_rounds = 16;
  double settled = 0.05;
  double most_weight = 6;

  /// A result is doubtful if the vertex of a landmark comes to lie farther from its position than
  /// this share of the size.
  double misplaced_landmark = 0.05;
} registration_constants;

}  // namespace dynmesh
