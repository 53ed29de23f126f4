/// The constants of registration that do not follow from its equations.
#pragma once

#include <array>
#include <cstddef>

#include "tracking/constants.hpp"

namespace dynmesh {

/// The constants of the rigid starts.
struct RigidStartConstants {
  /// The rotations to begin with, spread evenly (super-Fibonacci spirals, Alexa 2022).
  int rotations = 64;
  /// About so many points of the scan and places of the surface are compared, at first and at last,
  /// and how often their pairs are found.
  int coarse_scan = 250;
  int coarse_surface = 800;
  int coarse_steps = 10;
  int fine_scan = 1500;
  int fine_surface = 3000;
  int fine_steps = 20;
  /// The length of a unit normal beside positions, in mean distances from the centre.
  double coarse_normal = 0.3;
  double fine_normal = 0.15;
  /// The share of the pairs that is used.
  double kept = 0.8;
  /// So many starts are returned at most, which differ by at least this angle, in degrees.
  int starts = 6;
  double least_angle = 15;
  /// Those with a mean distance of more than so many times the least are not considered.
  double largest_ratio = 1.5;
};

/// The constants of the tips of limbs.
struct TipConstants {
  /// The number of tips of the template, and of the scan, of which some are none.
  std::size_t of_template = 6;
  std::size_t of_scan = 8;
  /// About so many points of the scan are used, the later numbers if what is found with the earlier
  /// ones is not good. Each is connected with its nearest neighbours, if they are at most so many
  /// mean distances between neighbours away and their normals have at least this cosine.
  std::array<std::size_t, 3> points = {2500, 6000, 12000};
  int neighbours = 10;
  double reach = 3;
  double least_cosine = -0.3;
  /// The weight of mean distances beside those of pairs, and how many pairings are tried of
  /// all tips, and of all but one.
  double mean_weight = 0.5;
  int candidates = 10;
  /// A tip of the scan was left out if no vertex is within so many mean edges. So many of them, the
  /// farthest ones, are tried at most, and so often.
  double left_out = 3;
  std::size_t most_left_out = 2;
  int repairs = 3;
  /// If more than this share of the points is far without them, they cannot help.
  double largest_far = 0.3;
};

struct RegistrationConstants {
  RigidStartConstants rigid;
  TipConstants tips;

  /// A scan is in another unit if the ratio of the sizes is beyond this, and then the unit is the
  /// nearest power of ten.
  double other_unit = 1.5;
  /// Without `scale`, a larger ratio is refused.
  double largest_ratio = 20;
  /// No landmark can be farther outside a scan than so many sizes of the template.
  double farthest_landmark = 2;
  /// With fewer points, nothing is determined.
  std::size_t fewest_points = 12;

  /// If the mean distance of the nearest pairs is less than this after a motion that began where
  /// the template is and that moves it by less than the second on average, both in mean edges, no
  /// other motion is sought.
  double in_place = 1;
  double largest_motion_in_place = 5;
  /// The same as shares of the size of the template, for coarse meshes.
  double in_place_share = 0.02;
  double largest_motion_share = 0.1;

  /// Larger templates get a coarse mesh.
  std::size_t most_coarse_vertices = 4000;
  /// How often the coarse mesh is drawn to the scan, of which about so many points are used, and
  /// the weight of a correspondence at first.
  int passes = 24;
  std::size_t coarse_points = 6000;
  double first_coarse_weight = 0.05;
  /// The weight of landmarks at first; it falls to 0.
  double coarse_landmark_weight = 1;
  /// The system is factored again after so many passes.
  int passes_with_a_factor = 4;
  /// The same for a trial of one of several candidates. The best ones are finished.
  int trial_passes = 9;
  std::size_t trial_points = 3000;
  std::size_t finished = 3;
  /// The second best is drawn into the scan as well, if it is elsewhere by more than this on
  /// average, in mean edges, and if its misfit is at most so many times that of the best, and so
  /// much more. If the misfit is hardly larger then, and the rigid starts were hardly farther from
  /// the scan, both poses fit. Without such starts, they do up to that ratio of misfits.
  double elsewhere = 1;
  double close_share = 1.5;
  double close_difference = 0.02;
  double equal_difference = 0.003;
  double equal_ratio = 1.1;
  /// A point is far from a coarse mesh beyond this, in its mean edges.
  double coarse_far = 1.5;

  /// The steps in which landmarks are first brought to their positions, the share of these in which
  /// they move there, their weight, and that of the membrane.
  int bending_steps = 30;
  double bending_share = 0.7;
  double bending_weight = 10;
  double bending_membrane = 1;

  /// The surface is pushed into the scan so often at most, until the vertices move by less than
  /// this on average, in mean edges.
  int most_rounds = 8;
  double settled = 0.05;
  /// So many rounds tell which of other poses may be better.
  int rounds_of_others = 2;
  /// The weight of a correspondence in the first iteration of a push.
  double first_weight = 0.2;
  /// The width of a pixel where the surface is drawn to find out what hides what, how far behind
  /// the front a vertex may lie, and the same for a vertex of a sheet that is seen from behind.
  double pixel = 1;
  double thickness = 1.5;
  double back_thickness = 0.5;
  /// About so many points are examined.
  std::size_t examined_points = 6000;
  /// The shares of far points from which on a result is doubtful, and ruined, and the share of
  /// points with a disagreeing normal from which on it is ruined.
  double doubtful_far = 0.01;
  double ruined_far = 0.05;
  double ruined_disagreeing = 0.1;
  /// Where points are sparse, a vertex has one within so many mean distances between them, which is
  /// at most this share of the size of the surface.
  double empty_spacings = 1.25;
  double largest_empty_radius = 0.1;
  /// The share of the vertices that should be seen and have no point, from which on it is doubtful.
  double doubtful_empty = 0.2;
  /// A vertex is in a hole if it has no point within so many times the distance at which it has
  /// none, and the share of the area that is one hole from which on the result is doubtful. Right
  /// results of whole scans reach 0.013.
  double hole_distance = 1.5;
  double doubtful_hole = 0.03;
  /// Vertices within a mean edge of each other and with this cosine between the normals overlap if
  /// the template has them so many mean edges apart; and the share of its area from which on the
  /// result is doubtful. Right results reach 0.002, limbs without points 0.1.
  double overlap_cosine = 0.5;
  double overlap_edges = 10;
  double doubtful_overlap = 0.005;
  /// Edges that have no point within so many mean edges, and that are so many times as long as in
  /// the template or as short, join what does not belong together; and the share of these from
  /// which on it is doubtful. A right result has an excess of their stretch over that of the others
  /// of at most 0.0035 of all edges, exchanged shins whose knees were not measured 0.006.
  double bridging_edges = 1.5;
  double bridging_stretch = 1.5;
  double doubtful_bridging = 0.003;
  double doubtful_bridging_excess = 0.005;
  /// The shares of all edges that are so much stretched or shortened from which on it is doubtful,
  /// as where the whole was squeezed into a part, and ruined. Faces and bones reach 0.09, waves
  /// 0.15.
  double doubtful_stretched = 0.15;
  double ruined_stretched = 0.3;
  /// It is doubtful too if the vertex of a landmark comes to lie farther from its position than
  /// this share of the size.
  double misplaced_landmark = 0.05;

  /// The constants with which a surface is pushed.
  [[nodiscard]] TrackingConstants fine() const {
    TrackingConstants constants;
    constants.prediction = 0;
    constants.first_weight = first_weight;
    return constants;
  }
};

}  // namespace dynmesh
