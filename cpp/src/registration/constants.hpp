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

/// The constants of the starts at which one surface lies on a part of the other one. Lengths are in
/// mean distances of the places of the part from its centre.
inline constexpr struct PartStartConstants {
  /// So many points of a scan are used at most.
  std::size_t points = 20000;
  /// The area of the whole is at least so many times that of the part.
  double least_whole = 0.7;
  /// So many places of the part are used at most, at first so few.
  std::size_t places = 300;
  std::size_t few_places = 24;
  /// So many of them, at least so far apart, are laid on points of the whole, turned by so many
  /// angles. The normals within a distance tell how flat the part is there.
  std::size_t laid_places = 3;
  double apart = 0.5;
  double around = 0.3;
  int angles = 16;
  /// The distance of these points, of which so many are used at most.
  double spacing = 0.25;
  std::size_t most_points = 2000;
  /// The length of a unit normal beside positions.
  double normal = 0.2;
  /// A place farther from all points is not explained, at first and at last.
  double reach = 0.35;
  double near_reach = 0.15;
  /// So many starts are kept at first, in the middle and at last, which differ by this distance on
  /// average.
  std::size_t laid = 100;
  std::size_t improved = 24;
  std::size_t starts = 4;
  double same = 0.2;
  /// How often the nearest pairs are found each time, and how many there must be.
  int steps = 6;
  std::size_t fewest_pairs = 8;
} part_start_constants;

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
  /// Points count that are nearer to the centre of the template than so many times its radius.
  double around = 1.5;
  /// How often the scale is sought, each time by the growth of the template that the last one left.
  int scalings = 3;

  /// Poses of the coarse mesh are the same if they are nearer to each other than this on average,
  /// in its mean edges, and the template follows at most so many.
  double same_pose = 0.5;
  std::size_t most_finished = 3;
  /// A pose of the coarse mesh that leaves and contradicts no more is drawn further at once.
  double complete = 0.01;
  /// Sensors may miss a share of what they should see.
  double unseen = 0.05;
  /// A template is good if what speaks against it adds up to no more than this: the share of what
  /// should be seen of it that has no point, what contradicts it, the points beside it that are
  /// farther than their noise, and the mean stretch of edges. Right ones have 0.07, wrong ones of
  /// other subjects mostly 0.2. Of what should be seen, no more may have no point, of which the
  /// largest connected piece, of the template, is no limb.
  double doubt = 0.13;
  double missing = 0.1;
  double hole = 0.035;
  double overlap = 0.003;  ///< of the template, where another part of it lies as well
  /// It is ruined if template and scan have a larger share not in common, or more contradicts it.
  double ruined_missing = 0.3;
  double ruined_contradicted = 0.2;
  /// If the areas of scan and template differ by more than this factor, one is sought as a part of
  /// the other first.
  double part = 1.5;
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
