/// Which place of a tracked surface each measured point lies at.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <dynmesh/topology.hpp>
#include <dynmesh/tracker.hpp>
#include <dynmesh/types.hpp>
#include <limits>
#include <span>
#include <vector>

#include "base/workers.hpp"
#include "shape/rotations.hpp"
#include "surface_fit/cloth.hpp"
#include "surface_fit/constants.hpp"
#include "surface_fit/lost_components.hpp"
#include "surface_fit/point_scan.hpp"
#include "surface_fit/surface_places.hpp"
#include "surface_fit/surface_rows.hpp"
#include "surface_fit/visibility.hpp"

namespace dynmesh {

/// How points are matched and weighed; lengths are in mean edges.
struct Search {
  /// A place that is this near, and agrees with its point, is taken for the nearest one if no place
  /// around it is nearer.
  double walked = 0;
  double weight = 1;
  /// Whether a point that disagrees with its nearest place looks for another place, as the surface
  /// still bends towards it; otherwise it is of something else.
  bool looks_farther = false;
  /// About so many of the points, evenly spread, suffice.
  std::size_t points = std::numeric_limits<std::size_t>::max();
  /// The distance at which a point counts half, whatever the material; 0: what is usual around it.
  double scale = 0;
};

/// How well a surface explains what was measured of it: all points, and those of each sensor.
struct Agreements {
  Agreement all;
  std::vector<Agreement> of_sensors;
};

/// The matches of the points of one frame with a surface X. Places that were found before in the
/// frame are where the next search begins.
class Matches {
 public:
  using Rows = std::vector<SurfaceRow>;

  /// Begins a sequence. All arguments but `first_frame` must outlive this object.
  Matches(std::span<const Triangle> faces, const Topology& topology, Workers& workers,
          const TrackingConstants& constants, Field first_frame, double mean_edge,
          std::span<const Material> materials, const Clusters& clusters);

  /// Lets points be matched with a finer surface in place of this one: `frame` lies on
  /// `finer_frame`, and the finer surface stays as high above the triangles as there.
  void measure_heights(Field frame, Matches& finer, Field finer_frame);

  /// Begins a frame. `measurement` must outlive it.
  void begin(const PointScan& measurement);
  /// Finds what the sensors can see of X. Until the next call, no point is matched with a place
  /// that another component hides from them.
  void look(Field x);
  /// (k,) 1 for the vertices that a sensor could see; empty for a single component.
  [[nodiscard]] std::span<const std::uint8_t> seen() const { return visibility_.is_seen; }

  /// Matches the points with X. The result is valid until the next call.
  const Rows& find(Field x, const Search& search);
  [[nodiscard]] const Rows& rows() const { return rows_; }
  /// (components,) 1 for those of whose points the scan has more than a small share of what their
  /// place in the views of the sensors promises, of the points that were matched last. Fewer are of
  /// something else.
  [[nodiscard]] std::vector<std::uint8_t> find_measured() const;
  /// The points that are far from X, after `locate`.
  [[nodiscard]] OrientedPoints unexplained() const;
  /// The distance within which this share of the vertices with a point has one. Where something
  /// else was measured beside the surface, its points are many, but few of them are the nearest.
  [[nodiscard]] double distance_of(double share) const;

  /// Finds the nearest places of all points alone, which makes no rows; `walked` as in Search.
  void locate(Field x, double walked);
  /// Lets the nearest places of the points, whatever their normals, follow X without a search, and
  /// finds which of them agree with their points.
  void follow(Field x);
  /// Visits those that are not far from their points, and agree, after `follow`.
  template <class Visit>
  void for_each_near(const Visit& visit) const {
    for (std::size_t i = 0; i < found_.size(); ++i) {
      if (!is_far(found_[i]) && agrees_[i] != 0) visit(found_[i]);
    }
  }
  /// (k,) of the surface, outwards and of unit length.
  [[nodiscard]] Field normals() const { return normals_; }
  /// The root mean square distance of the far points; one without a place is as far as any search
  /// goes. 0 if none is far.
  [[nodiscard]] double distance_of_far() const;
  /// How well X explains the points, on the side that the sensors see, and of sheets on both, after
  /// `follow`.
  [[nodiscard]] Agreements agreements() const;

 private:
  /// Whether its point is far from the surface: more than one mean edge, as reports promise. Nearer
  /// points that agree tell which vertices are observed.
  [[nodiscard]] bool is_far(const Place& place) const {
    return place.squared > mean_edge_ * mean_edge_;
  }
  [[nodiscard]] const Material& material_of(const Place& place) const {
    return materials_[topology_.component[place.corners[0]]];
  }
  [[nodiscard]] Vector3 agreeing_normal(const Place& place, std::size_t point) const;
  void find_normals(Field x);
  /// A point is of the outermost layer on its line of sight.
  [[nodiscard]] bool is_outermost(const Place& place) const {
    return is_hidden_.empty() || is_hidden_[place.face] == 0;
  }
  /// A place, and the normal of the surface there on the side of its point; 0 if they disagree.
  struct Match {
    Place place;
    Vector3 normal;
  };
  [[nodiscard]] Match nearest(Field x, std::size_t point, const Place& from,
                              const Search& search) const;
  /// Calls `visit(first, last)` for blocks of points in a row, several at a time.
  template <class Visit>
  void for_each_block(const Visit& visit) const;
  [[nodiscard]] double height(const Place& place) const;
  void weigh(Field x, const Search& search, double points_of_row);
  [[nodiscard]] std::vector<double> nearest_distances() const;
  [[nodiscard]] std::vector<double> usual_distances() const;

  std::span<const Triangle> faces_;
  const Topology& topology_;
  Workers& workers_;
  const TrackingConstants& constants_;
  double mean_edge_;
  std::span<const Material> materials_;
  const Clusters& clusters_;
  std::vector<double> outside_;  // of each component: -1 if its faces are wound inwards, else 1
  std::vector<std::array<double, 3>> heights_;  // above the sides of the faces, or empty
  Boundary boundary_;
  SurfacePlaces places_;

  const PointScan* measurement_ = nullptr;
  std::vector<std::uint32_t> order_;  // of the points, along a curve
  struct Point {
    Vector3 position, normal;
    bool is_undecided;
  };
  // In this order:
  std::vector<Point> points_;
  std::vector<Place> found_;
  std::vector<std::uint8_t> agrees_;
  std::vector<Vector3> normals_;
  // Of a surface of several components, as it was looked at last:
  std::vector<std::uint8_t> is_sheet_;  // (k,)
  Visibility visibility_;
  std::vector<std::uint8_t> is_hidden_;  // (faces,), or empty
  Rows rows_;
};

}  // namespace dynmesh
