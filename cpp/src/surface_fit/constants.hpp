/// The constants of tracking that do not follow from its equations. Lengths are in mean edge
/// lengths of frame 0.
#pragma once

#include <cstddef>
#include <limits>

namespace dynmesh {

/// Conjugate gradients end after so many steps, or at this share of the error.
struct SolverLimits {
  int steps = 0;
  double settled = 0;
};

struct TrackingConstants {
  /// The iterations of a frame run on a coarse mesh if the template has more vertices than this:
  /// on so many of them, at most half, and with at least so many of each component. At most so many
  /// follow on the template, until it lies still. All that is left there is smooth and slow to
  /// solve.
  std::size_t coarse_vertices = 2500;
  std::size_t share_of_vertices = 2;
  std::size_t fewest_vertices = 60;
  int whole_iterations = 2;
  SolverLimits whole_solution = {10, 1e-3};
  /// How much the share of the last correction grows in a frame that leads on in its direction, and
  /// its largest value; and how far beyond where they lead the iterations go, for a share of 1.
  double correction_growth = 0.3;
  double largest_correction = 0.7;
  double beyond_correction = 0.4;
  /// In all but so many last iterations, the surface has not arrived, and is stiff: it needs only
  /// so many points for each vertex, evenly spread. A coarse mesh, which the template follows,
  /// needs no more at all. Of these, so many for each component tell whether a frame begins where
  /// the last two lead to, and how components move rigidly.
  int final_iterations = 2;
  std::size_t points_of_vertex = 3;
  /// A gap between the points at the boundary of cloth draws it inwards, and it slides, so that it
  /// needs more of them.
  std::size_t points_of_cloth = 6;
  std::size_t rigid_points = 1000;
  /// The largest number of points; others are left out.
  std::size_t most_points = std::numeric_limits<std::size_t>::max();

  /// The share of the last motion with which the next one begins: of a frame, and of an iteration
  /// (the heavy ball, Polyak 1964).
  double prediction = 0.6;

  /// A distance below which nothing matters: the surface lies still if a rigid step moves no vertex
  /// farther, a place that agrees with its point is near enough to need no search of the whole
  /// surface, points that are nearer than this count at least a quarter, and the boundary of cloth
  /// lies as far beyond its points, so that it does not follow their spacing.
  double resolution = 0.3;
  /// A point that comes to a place from that of another one has not seen layers that are nearer to
  /// each other than the resolution, as closed lips are. So where the surface arrives, its place
  /// must be as near as so many times the median of those of one in so many points, which are
  /// searched on the whole surface.
  double usual_walk = 8;
  double least_walk = 0.05;
  std::size_t points_of_search = 100;

  /// How often points are matched at most, while the whole surface moves rigidly and then while it
  /// bends, as always with cloth, whose points do not tell how far it slides; and how many times
  /// more than at least for each mean edge within which this share of the vertices has a point at
  /// first.
  int most_iterations = 8;
  double iterations_per_edge = 2;
  double far_share = 0.98;
  SolverLimits solution = {12, 3e-3};
  /// The preconditioner has so much of the weights of the points at a vertex, which tell one of its
  /// three coordinates each.
  double preconditioned = 0.67;
  /// It is factored for the middle of the weights of some iterations, and again where they have
  /// grown so many times.
  double factored_growth = 8;
  /// The weight of a point of `usual_noise` in the last iteration, how much smaller it is in each
  /// one before, and its smallest value: the stiff surface first comes to lie right as a whole. The
  /// modes of a training sequence are fitted with the smallest, as the noise of the points and what
  /// is between them then say little. The membrane of cloth lets its weights be larger, since it
  /// keeps the noise of the points and wrong matches from folding the surface.
  double last_weight = 2;
  double weight_growth = 2.2;
  double first_weight = 0.05;
  /// Points of another noise weigh in inverse proportion to their variance, of which the square of
  /// this is left where they are exact: so far is the surface from what triangles can follow.
  double usual_noise = 0.14;
  double least_noise = 0.1;
  /// After frames in which a subject rests, points weigh less, so that their noise bends it less,
  /// down to a least share, and more again once it moves: this to the power of the correlation of
  /// two steps, of vertices that moved by more than so many mean edges.
  double times_weight_growth = 8;
  double hardly_moved = 0.003;
  double least_times_weight = 0.125;
  double cloth_weights = 60;
  /// How far from the surface points are matched. While the whole surface moves rigidly, a point at
  /// half of this counts half.
  double radius = 8;
  /// A point counts a quarter at so many times the median of the distances of the vertices around
  /// it from their nearest points, at least at the resolution and at most at `largest_scale`.
  double usual_distances = 6;
  double largest_scale = 1.5;
  /// The least cosine between the normal of a point and that of the surface at its place. A point
  /// that is farther than `near` looks for a place that agrees if the nearest one does not, and
  /// lies along its normal, with this least cosine.
  double agreement = 0.7;
  double near = 0.8;
  double along = 0.8;
  /// How far the place of a point may move on a coarse mesh while what was measured there of the
  /// template counts a quarter: details are no larger.
  double corrected_within = 0.1;
  double corrected_steps = 0.1;  ///< of most vertices in the last frame, up to which it is compared
  /// The share of the shape of frame 0 in the shape that is wanted, beside that of the last frame.
  /// Folds of cloth come and go, and frame 0 knows none of them.
  double pull = 0.4;
  double cloth_pull = 0.1;
  /// mu, the weight of the shape of triangles.
  double membrane = 0.02;
  double cloth_membrane = 8;
  /// The weight with which vertices are held where they are, a share of mu. It decides where
  /// nothing else does, and keeps cloth from sliding far along itself for the few points that first
  /// tell of a fold.
  double hold = 1e-4;
  /// The weight of ties of components where they touch, the departure at which a tie has a quarter
  /// of its weight, and the share of a squared departure that counts a frame later.
  double tie_weight = 0.3;
  double tie_departure = 0.3;
  double kept_departure = 0.9;
  /// Walls that are thinner than this keep their thickness, which the noise of points would hide.
  double wall = 0.5;
  /// While components move rigidly, ties weigh as much as one point and this share of the points of
  /// a component, and at first so many times more, so that all components move as one; each step
  /// divides that. They draw to the differences of frame 0 by a share of what is off.
  double tie_share = 0.2;
  double first_stiffness = 30;
  double stiffness_growth = 3;
  double tie_pull = 0.1;
  /// Fewer points than this move no surface.
  std::size_t fewest = 12;
  /// Components whose points have a smaller sum of weights are not drawn to them: six points
  /// determine a rigid motion.
  double least_weight = 6;
  /// Nor are those that have a smaller share of the points that their share in what the sensors see
  /// of the surface promises.
  double least_measured = 0.2;
  /// Components that ties hold together begin a frame elsewhere than the others if their vertices
  /// are nearer to points there by more than this on average, each group at so many vertices.
  double own_start = 0.5;
  std::size_t vertices_of_start = 50;
  /// So many vertices of a lost component are sought among the points.
  std::size_t vertices_of_search = 200;

  /// A point that is far from the surface is stray, and of no surface, if the points around it are
  /// so many times farther from it than usual.
  double stray_spacing = 2;

  /// A first scan is refused if most of its points are far, and a smaller share of the vertices is
  /// observed.
  double least_observed_at_first = 0.1;
  /// Of so many frames in which the surface is lost, at most one is registered anew.
  int frames_between_recoveries = 10;

  /// A sheet is cloth if its own planes notice one of its rigid motions by less than this share of
  /// the mean squared displacement: cloth has up to 0.02, a face 0.07. The planes are those of
  /// pieces, smoothed over this share of the extent of the sheet.
  double largest_slippage = 0.04;
  double smoothed_share = 0.1;
  /// Colours that vary, over this length, by as much as they are usually off weigh as much as the
  /// plane of their point, and others less, down to a share that is not worth a row. One that is
  /// off by so many times what is usual, or whose place would be so far, counts a quarter. Those of
  /// a vertex are fitted to its points so often.
  double colour_noise = 0.1;
  double least_colour_weight = 0.02;
  double usual_colours = 8;
  double farthest_colour = 1;
  int colour_fits = 5;
  /// The weight of a row that draws the boundary to where the points end, compared with that of a
  /// point, and how far a vertex of that of cloth lies beyond them at most; what is farther was not
  /// seen. Points that lie as far beyond the boundary tell that the scan goes on there.
  double boundary_weight = 4;
  double farthest_end = 2.5;

  /// The jump in depth between neighbouring pixels from which on they belong to different surfaces.
  double jump = 3;
  /// Of depth images, one to four times so many points for each vertex are used.
  std::size_t pixels_per_vertex = 4;
};

}  // namespace dynmesh
