/// Which place of a tracked surface each measured point lies at.
#pragma once

#include <cstddef>
#include <cstdint>
#include <dynmesh/topology.hpp>
#include <dynmesh/types.hpp>
#include <span>
#include <vector>

#include "detail/rotations.hpp"
#include "detail/surface_rows.hpp"
#include "mesh/triangle.hpp"
#include "support/workers.hpp"
#include "tracking/constants.hpp"
#include "tracking/point_scan.hpp"
#include "tracking/surface_places.hpp"

namespace dynmesh {

/// How points are matched and weighed; lengths are in mean edges.
struct Search {
  double radius = 0;
  double weight = 0;
  double cloth_weight = 0;
  double scale = 0;  ///< the distance at which a point counts half; 0: what is usual around it
};

/// The matches of the points of one frame with a surface X. Places that were found before in the
/// frame are where the next search begins. Allocates memory in the constructor, and where a
/// measurement is larger than all earlier ones.
class Matches {
 public:
  using Field = std::span<const Vector3<double>>;

  /// All arguments must outlive this object.
  Matches(std::span<const Triangle> faces, const Topology& topology, Workers& workers,
          const TrackingConstants& constants);

  /// Begins a sequence. `clusters` must outlive it.
  void reset(Field first_frame, double mean_edge, std::span<const std::uint8_t> is_cloth,
             const Clusters& clusters);

  /// Begins a frame. `measurement` must outlive it.
  void begin(const PointScan& measurement);

  /// Matches the points with X. The result is valid until the next call.
  SurfaceRows& find(Field x, const Search& search);
  /// (n,) the nearest place to each point in it, whatever the normals, as far as the radius.
  [[nodiscard]] std::span<const Place> nearest() const { return found_; }
  /// The distance below which this share of the points matched in it is.
  [[nodiscard]] double distance_of(double share) const;

  /// (k,) the normals of the last X, outwards where the surface has an outside.
  [[nodiscard]] Field normals() const { return normals_; }
  /// (k,) 1 for the vertices of sheets, which are measured from both sides.
  [[nodiscard]] std::span<const std::uint8_t> is_sheet() const { return is_sheet_; }

 private:
  [[nodiscard]] Vector3<double> agreeing_normal(const Place& place, std::size_t point) const;
  void find_places(Field x, const Search& search);
  void find_normals(Field x);
  void weigh(Field x, const Search& search);
  void find_boundaries();
  [[nodiscard]] bool is_on_boundary(const Place& place) const;
  void draw_boundaries(Field x, std::size_t n_points);
  void find_usual_distances();

  std::span<const Triangle> faces_;
  const Topology& topology_;
  Workers& workers_;
  const TrackingConstants& constants_;
  const PointScan* measurement_ = nullptr;
  const Clusters* clusters_ = nullptr;
  double mean_edge_ = 1;
  bool any_cloth_ = false;
  std::vector<std::uint8_t> is_sheet_, is_cloth_;
  std::vector<double> outside_;  // of each component: -1 if its faces are wound inwards, else 1
  std::vector<std::uint8_t> is_boundary_;  // of each corner of a face: of the edge opposite
  std::vector<std::uint8_t> at_boundary_;  // (k,)
  std::vector<double> outermost_;          // (k,) of the points matched around a boundary vertex
  std::vector<double> beyond_;             // (k,) how far points lie beyond a boundary vertex
  std::vector<Vector3<double>> conormals_;
  SurfacePlaces places_;
  std::vector<Vector3<double>> normals_;
  std::vector<std::uint32_t> order_;  // of the points
  std::vector<Place> found_;          // of each point
  SurfaceRows rows_;
  std::vector<double> usual_;  // of each cluster
  std::vector<std::uint32_t> ends_;
  std::vector<float> distances_;
  std::vector<std::uint8_t> ends_at_;  // whether the place of a point is on the boundary
};

}  // namespace dynmesh
