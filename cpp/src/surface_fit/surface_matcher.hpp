/// Which place of a tracked surface each measured point lies at.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <dynmesh/topology.hpp>
#include <dynmesh/tracker.hpp>
#include <dynmesh/types.hpp>
#include <functional>
#include <limits>
#include <span>
#include <vector>

#include "base/workers.hpp"
#include "shape/memory.hpp"
#include "shape/rotations.hpp"
#include "surface_fit/boundary.hpp"
#include "surface_fit/constants.hpp"
#include "surface_fit/finer_heights.hpp"
#include "surface_fit/point_scan.hpp"
#include "surface_fit/surface_places.hpp"
#include "surface_fit/surface_rows.hpp"
#include "surface_fit/visibility.hpp"

namespace dynmesh {

/// How points are matched and weighed; lengths are in mean edges.
struct MatchOptions {
  /// A place that is this near, and agrees with its point, is taken for the nearest one if no place
  /// around it is nearer.
  double walked = 0;
  /// Whether it must also be as near as is usual. Triangles of a coarse mesh are farther from their
  /// points than layers of a surface are from each other.
  bool tells_layers = false;
  double weight = 1;
  /// Whether a point that disagrees with its nearest place looks for another place, as the surface
  /// still bends towards it; otherwise it is of something else.
  bool looks_farther = false;
  /// About so many of the points, evenly spread, suffice.
  std::size_t points = std::numeric_limits<std::size_t>::max();
  /// The distance at which a point counts half, whatever the material; 0: what is usual around it.
  double scale = 0;
  /// What is remembered of the colours of the surface, if they are to be matched.
  const SurfaceColours* colours = nullptr;
};

/// The points of a scan, or some of them, and the place of each on a surface X. Places that were
/// found before in the frame are where the next search begins.
struct MatchedPoints {
  struct Point {
    Vector3 position, normal;
    bool is_undecided;
  };

  const PointScan* scan = nullptr;
  double mean_edge = 0;
  // In an order along a curve:
  std::vector<std::uint32_t> numbers;  ///< in the scan
  std::vector<Point> points;
  std::vector<Place> places;
  std::vector<std::uint8_t> agrees;  ///< 1 for places that agree, after `update_distances`

  /// Where a finer surface lies, beside what its heights tell: `offset` at a place, and near it.
  struct Correction {
    Place place;
    Vector3 offset;
  };
  std::vector<Correction> corrections = {};  ///< of each point, after `compare_with`, or empty

  /// Whether its point is far from the surface: more than one mean edge, as reports promise. Nearer
  /// points that agree show which vertices are observed.
  [[nodiscard]] bool is_far(const Place& place) const {
    return place.squared > mean_edge * mean_edge;
  }
  /// Visits the places that are not far from their points, and agree.
  template <class Visit>
  void for_each_near(const Visit& visit) const {
    for (std::size_t i = 0; i < places.size(); ++i) {
      if (!is_far(places[i]) && agrees[i] != 0) visit(places[i]);
    }
  }
};

/// How well a surface explains what was measured of it: all points, and those of each sensor.
struct Agreements {
  Agreement all;
  std::vector<Agreement> of_sensors;
};

/// How well X explains the points, on the side that the sensors see, and of sheets on both, after
/// `update_distances`.
Agreements agreements_of(const MatchedPoints& points, const TrackingConstants& constants);
/// The root mean square distance of the far points, of which none counts more than `widest`; 0 if
/// none is far.
double distance_of_far(const MatchedPoints& points, double widest);

/// Matches points with a surface X. Keeps nothing of a frame.
class SurfaceMatcher {
 public:
  using Rows = std::vector<SurfaceRow>;

  /// All arguments but `first_frame` must outlive this object.
  SurfaceMatcher(std::span<const Triangle> faces, const Topology& topology, Workers& workers,
                 const TrackingConstants& constants, Field first_frame, double mean_edge,
                 std::span<const Material> materials, const Clusters& clusters);

  /// Lets points be matched with a finer surface in place of this one: `frame` lies on
  /// `finer_frame`, and the finer surface stays as high above the triangles as there.
  void measure_heights(Field frame, SurfaceMatcher& finer, Field finer_frame);
  /// Corrects the heights for points: where X stays, they are matched with `finer_frame` itself.
  void compare_with(Field x, const Visibility& visibility, const SurfaceMatcher& finer,
                    Field finer_frame, MatchedPoints& points);

  /// The points of a scan, which must outlive them, so far without places.
  [[nodiscard]] MatchedPoints points_of(const PointScan& scan) const;
  /// (k,) of X, outwards and of unit length.
  [[nodiscard]] std::vector<Vector3> normals_of(Field x) const;
  /// What the sensors of a scan can see of X.
  [[nodiscard]] Visibility visibility_of(Field x, const PointScan& scan) const;

  /// Matches points with what is visible of X.
  Rows match(Field x, const Visibility& visibility, const MatchOptions& options,
             MatchedPoints& points);
  /// Finds the nearest places of all points alone, which makes no rows; `walked` as in
  /// MatchOptions.
  void nearest_places(Field x, const Visibility& visibility, double walked, MatchedPoints& points);
  /// Lets the nearest places of the points, whatever their normals, follow X without a search, and
  /// finds which of them agree with their points. `normals` (k,) are those of X, as normals_of.
  void update_distances(Field x, Field normals, const Visibility& visibility,
                        MatchedPoints& points) const;

  /// (components,) 1 for those of whose points the scan has more than a small share of what their
  /// place in the views of the sensors promises. Fewer are of something else.
  [[nodiscard]] std::vector<std::uint8_t> find_measured(const Visibility& visibility,
                                                        const MatchedPoints& points) const;
  /// The distance within which this share of the vertices with a point has one. Where something
  /// else was measured beside the surface, its points are many, but few of them are the nearest.
  [[nodiscard]] double distance_of(double share, std::span<const SurfaceRow> rows) const;

 private:
  /// X as it is matched.
  struct Surface {
    Field x;
    Field normals;
    const Visibility& visibility;

    [[nodiscard]] bool shows(const Place& place) const { return visibility.shows(place.face); }
  };
  /// A place, and the normal of the surface there on the side of its point; 0 if they disagree.
  struct Match {
    Place place;
    Vector3 normal;
  };
  using Point = MatchedPoints::Point;

  [[nodiscard]] const Material& material_of(const Place& place) const {
    return materials_[topology_.component[place.corners[0]]];
  }
  [[nodiscard]] double widest() const { return constants_.radius * mean_edge_; }
  [[nodiscard]] Vector3 agreeing_normal(const Surface& surface, const Place& place,
                                        const Point& point) const;
  /// How near, in mean edges, a place that a point walked to must be: nearer than `most` to be of
  /// the same component as the nearest one, and than `sure` to be the nearest one.
  struct Walk {
    double most = 0;
    double sure = 0;
  };
  [[nodiscard]] Match nearest(const Surface& surface, const Point& point, const Place& from,
                              const Walk& walk) const;
  [[nodiscard]] double usual_walk(std::size_t n, double most,
                                  const std::function<Place(std::size_t)>& place_of) const;
  [[nodiscard]] Match farther(const Surface& surface, const Point& point) const;
  /// Calls `visit(first, last)` for blocks of points in a row, several at a time.
  template <class Visit>
  void for_each_block(std::size_t n, const Visit& visit) const;
  [[nodiscard]] Vector3 to_finer(const Surface& surface, const Match& match) const;
  void weigh(const Surface& surface, const MatchOptions& options, double points_of_row,
             const MatchedPoints& points, Rows& rows) const;
  [[nodiscard]] std::vector<double> nearest_distances(std::span<const SurfaceRow> rows) const;
  [[nodiscard]] std::vector<double> usual_distances(std::span<const SurfaceRow> rows) const;

  std::span<const Triangle> faces_;
  const Topology& topology_;
  Workers& workers_;
  const TrackingConstants& constants_;
  double mean_edge_;
  std::span<const Material> materials_;
  const Clusters& clusters_;
  std::vector<double> outside_;  // of each component: -1 if its faces are wound inwards, else 1
  std::vector<std::uint8_t> is_sheet_;  // (k,)
  FinerHeights heights_;
  Boundary boundary_;
  SurfacePlaces places_;
};

}  // namespace dynmesh
