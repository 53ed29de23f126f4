/// The constants of tracking that do not follow from its equations. Lengths are in mean edge
/// lengths of frame 0.
#pragma once

#include <cmath>

namespace dynmesh {

/// docs/limits.md shows how much the error changes if a value is halved or doubled.
struct TrackingConstants {
  /// The share of the last motion with which the next one begins.
  double prediction = 0.6;

  /// How often the whole surface is moved rigidly before it bends.
  int rigid_steps = 2;
  /// How far these steps search for points, and the distance at which a point counts half.
  double rigid_radius = 12;
  double rigid_scale = 4;
  /// What the planes do not determine of a rigid motion stays small: this share of the mean
  /// diagonal is added to its system.
  double rigid_caution = 1e-3;
  /// Six points determine a rigid motion, if all are good; fewer than this are not used.
  int least_rigid = 12;
  /// About so many vertices are used for a rigid motion.
  int rigid_vertices = 2048;

  /// How often correspondences are found and rotations fitted, at least, and the steps of
  /// conjugate gradients for each.
  int iterations = 4;
  int steps = 6;
  /// How often, after the first iteration, rotations are fitted for the same correspondences. More
  /// often takes longer, and keeps the surface from sliding along itself.
  int rotation_fits = 1;
  /// The weight of a correspondence in the first iteration and in the last; it grows by equal
  /// factors. The stiff surface first comes to lie right as a whole.
  double first_weight = 0.0025;
  double last_weight = 0.4;
  [[nodiscard]] double weight_at(double progress) const {
    return first_weight * std::pow(last_weight / first_weight, progress);
  }
  [[nodiscard]] double cloth_weight_at(double progress) const {
    return first_cloth_weight * std::pow(last_cloth_weight / first_cloth_weight, progress);
  }
  /// How far the first half of the iterations searches for points, and the second.
  double wide_radius = 8;
  double narrow_radius = 3;
  /// The distance within which a vertex keeps the point of the last iteration. A point that is
  /// nearer lies on nearly the same plane. Cloth slides along itself, so it keeps none.
  double kept_distance = 0.5;
  /// The distance at which a correspondence counts half.
  double scale = 1.5;
  /// The distance along the surface at which it counts half. Measured points lie closer than that,
  /// so what is farther aside was not measured.
  double side = 1.5;
  /// The number of vertices that may share a point, as a multiple of the mean one, and 1 at least.
  /// Where more do, the weight of each falls with the square of their number.
  double vertices_per_point = 1.5;
  /// The least cosine between the normal of a vertex and that of its point.
  double agreement = 0.8;
  /// The share of the shape of frame 0 in the shape that is wanted, beside that of the last frame.
  double pull = 0.3;
  /// The iteration in which the modes of a training sequence are fitted, counted from 0. Its weight
  /// is small, so that the noise of the points and what is between them say little.
  int fitting_iteration = 1;
  /// The size up to which coefficients of the modes are kept that the points do not determine. The
  /// shape of the last frame keeps hidden parts as they were; modes that keep them as well would
  /// confirm positions that were found wrongly.
  double largest_kept = 0;

  /// A measured point is unexplained if the nearest vertex is at least this far, and it draws the
  /// vertex if that is nearer than the second. The distance at which it counts half, and its weight
  /// compared with other correspondences.
  double least_unexplained = 1.5;
  /// It does not draw a vertex that has a point of its own this near: it is of something else.
  double explained = 1.5;
  double drawing_radius = 24;
  double drawing_scale = 12;
  double drawing_weight = 1;
  /// If the share of the points that is unexplained exceeds that of the visible vertices without a
  /// point by more than this, they are of other things, and nothing is drawn.
  double largest_limb = 0.25;
  /// About so many of the points are examined.
  int examined_points = 4096;
  /// The first iteration is repeated while more than this share of the points is unexplained, so
  /// often at most.
  double lost_share = 0.02;
  int most_searches = 12;

  /// The width of a pixel where the surface is drawn to find out what hides what, and how far
  /// behind the front a vertex may lie, and before what a camera measured.
  double pixel = 1;
  double thickness = 1.5;
  /// The same for a vertex of a sheet that is seen from behind.
  double back_thickness = 0.5;

  /// A measured point is far from the surface beyond this.
  double far_distance = 1;
  /// It is stray, and of no surface, if the so manyth nearest of all points around it is at
  /// least so many times farther from it than usual.
  int stray_neighbours = 4;
  double stray_spacing = 2;
  /// The normal of a point disagrees with the surface below this cosine; if its direction is
  /// undecided, below the second.
  double least_cosine = 0;
  double least_undecided_cosine = 0.3;

  /// A vertex counts as observed if its point is at most this far.
  double observed_distance = 1;
  /// Components are not solved for if the weights of their correspondences, each at most 1, have a
  /// smaller sum.
  double fewest = 12;

  /// In the first frame, at least this share of the vertices that a sensor sees (or of the points,
  /// if they are fewer) must have a correspondence, or a rigid alignment of the whole template is
  /// tried.
  double least_found = 0.1;
  /// The number of its steps, and the share that it must reach.
  int alignment_steps = 40;
  double least_aligned = 0.3;

  /// A frame of which a larger share of the points is far from the surface is lost, and the number
  /// of frames of which at most one is registered anew for that.
  double lost_far = 0.05;
  int frames_between_recoveries = 10;

  /// A sheet is cloth if its own planes notice one of its rigid motions by less than this share of
  /// the mean squared displacement. Cloth has up to 0.02, a face 0.07.
  double largest_slippage = 0.04;
  /// As the constants above without "cloth". A membrane lets the weights be larger, since it keeps
  /// the noise of the points and wrong correspondences from folding the surface.
  double first_cloth_weight = 0.5;
  double last_cloth_weight = 10;
  double narrow_cloth_radius = 1;
  int cloth_rotation_fits = 3;
  int cloth_steps = 5;
  /// mu, the weight of the shape of triangles.
  double membrane = 8;
  /// As `pull`, for cloth. Folds come and go, and frame 0 knows none of them.
  double cloth_pull = 0.1;

  /// The weight of the reach of a boundary vertex, compared with its correspondence.
  double reach_weight = 2;
  /// Where the sum of the edges of a boundary vertex is shorter along the surface, there is no way
  /// outwards.
  double least_outward = 0.2;
  /// The measured surface is followed in steps of this length, by points that are at most so far
  /// from the steps and so far above or below the vertex.
  double reach_step = 0.5;
  double reach_radius = 0.75;
  double reach_height = 0.5;
  /// It ends where no point is found over this length. Farther than the second length, it counts
  /// as going on: then it is the template that ends, as at a cut limb.
  double reach_gap = 1.2;
  double farthest_reach = 8;
  /// A boundary vertex beyond the measured surface lies at least this far from its end, so that it
  /// does not follow the spacing of the points, and at most so far: what is farther has left the
  /// picture.
  double least_overshoot = 0.2;
  double farthest_overshoot = 3;
  /// It is not drawn back where the surface is already shorter there than this share of its length
  /// in frame 0, as it would become while it leaves the picture.
  double least_stretch = 0.9;

  /// The jump in depth between neighbouring pixels from which on they belong to different surfaces.
  double jump = 3;
};

/// The constants of the rigid alignment that is tried from several rotations.
struct AlignmentConstants {
  /// A template lies in a scan if typical distances are at most this many mean edges, which a
  /// tracker can bridge in one frame, and at most this share of its size, for coarse meshes.
  double within = 5;
  double within_share = 0.1;
  /// After the best rigid motion, a template has another pose than the scan, or is another mesh, if
  /// typical distances are more than this many mean edges, and more than this share of its size,
  /// which the noise of scans of fine meshes does not reach.
  double far = 2.5;
  double far_share = 0.02;
  /// A scan so many times larger or smaller than a template is in another unit.
  double other_unit = 20;

  /// About so many points of the scan and of the surface are compared, at first and at last.
  int coarse_scan = 250;
  int coarse_surface = 600;
  int fine_scan = 1000;
  int fine_surface = 4000;
  /// How often their pairs are found.
  int coarse_steps = 12;
  int fine_steps = 15;
  /// How many of the coarse results are refined.
  int candidates = 4;
  /// The share of the pairs that is used. Scans may contain more than the subject.
  double kept = 0.8;
  /// The share of a surface that a single camera sees at least.
  double seen = 0.4;
  /// What the planes do not determine stays small, as `rigid_caution`; but steps are not shortened.
  double caution = 1e-9;
};

}  // namespace dynmesh
