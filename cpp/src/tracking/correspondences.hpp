/// Which measured point each vertex of a tracked surface follows.
#pragma once

#include <cstddef>
#include <cstdint>
#include <dynmesh/topology.hpp>
#include <dynmesh/types.hpp>
#include <memory>
#include <span>
#include <vector>

#include "mesh/triangle.hpp"
#include "support/workers.hpp"
#include "tracking/agreement.hpp"
#include "tracking/boundary_reach.hpp"
#include "tracking/constants.hpp"
#include "tracking/measurement.hpp"
#include "tracking/point_scan.hpp"
#include "tracking/visibility.hpp"

namespace dynmesh {

/// How correspondences are found and weighed; lengths are in mean edges.
struct Search {
  double radius = 0;
  double scale = 0;  ///< the distance at which a point counts half,
  double side = 0;   ///< and the distance along the surface
  double weight = 0;
  std::size_t stride = 1;  ///< every so manyth vertex takes part
  double kept = 0;  ///< a vertex keeps its last point within this distance, though not the nearest
};

/// The correspondences of a surface X with the measurement of one frame. Points that were found
/// before in the frame are kept, which makes finding them again faster. Allocates memory in
/// `begin`, and where a measurement is larger than all earlier ones.
class Correspondences {
 public:
  using Field = std::span<const Vector3<double>>;

  /// `faces`, `topology`, `workers` and `constants` must outlive this object.
  Correspondences(std::span<const Triangle> faces, const Topology& topology, Workers& workers,
                  const TrackingConstants& constants);

  /// What a sequence in which (k,) `is_cloth` needs, and its beginning.
  [[nodiscard]] std::unique_ptr<BoundaryReach> prepare(
      Field first_frame, std::span<const std::uint8_t> is_cloth) const;
  void reset(std::unique_ptr<BoundaryReach> boundary,
             std::span<const std::uint8_t> is_cloth) noexcept;

  /// Begins a frame. `measurement` must outlive it. `mean_edge` is that of frame 0.
  void begin(const Measurement& measurement, double mean_edge);

  /// Finds which vertices of X the sensors can see. It changes little while X moves by few edges,
  /// so it is needed only where X has just been predicted, or moved as a whole.
  void find_visible(Field x);
  /// (k,) the result.
  [[nodiscard]] std::span<const Sight> visible() const { return visible_; }

  /// Finds (k,) the points of the vertices that the sensors can see.
  std::span<Correspondence> find(Field x, const Search& search) { return find(x, search, search); }
  /// The same with another search for cloth.
  std::span<Correspondence> find(Field x, const Search& search, const Search& of_cloth);
  /// (k,) the last result.
  [[nodiscard]] std::span<const Correspondence> found() const { return found_; }
  /// How many vertices have a point in it.
  [[nodiscard]] std::size_t n_found() const { return n_found_; }
  /// Whether at least this share of the visible vertices, or of the points if they are fewer, are
  /// found.
  [[nodiscard]] bool have_share(double share) const;

  /// Where a sensor looked through a vertex at something farther, the surface is not. Such vertices
  /// of cloth, if they have no point, are drawn to the nearest one, whatever its normal. Changes
  /// the last result of `find`; `weight` is that of its search for cloth.
  void draw_out_of_free_space(Field x, double weight);

  /// Measured points that are far from all vertices draw the nearest one: so a limb that lies on
  /// the wrong one comes back. Changes the last result of `find`; `weight` and `cloth_weight` are
  /// those of its searches. Returns the share of such points.
  double draw_towards_unexplained(Field x, double weight, double cloth_weight);

  /// How far the measured points are from the surface, after the last `find`.
  [[nodiscard]] Agreements compare(Field x) const;

  /// (k,) where the measured surface ends at the boundaries of cloth; empty without any.
  std::span<const Reach> find_reaches(Field x);

 private:
  void find_normals(Field x);
  void choose_sides(Field x);
  void find_visible_normals(Field x);
  void index_vertices(Field x);
  [[nodiscard]] bool shows_both_sides(std::size_t v) const;
  void weigh_shared_points();
  [[nodiscard]] bool is_near(Field x, std::uint32_t point, std::size_t v, double radius) const;
  [[nodiscard]] double share_without_point(Field x, double distance) const;

  std::span<const Triangle> faces_;
  std::vector<std::uint8_t> is_sheet_;  // whether the back of a vertex can be seen
  const Topology& topology_;
  Workers& workers_;
  const TrackingConstants& constants_;
  const Measurement* measurement_ = nullptr;
  std::vector<std::uint8_t> is_cloth_;
  std::vector<double> sides_;  // of each component: below 0 if its faces look away from the sensors
  std::unique_ptr<BoundaryReach> boundary_;  // of cloth, if there is any
  double mean_edge_ = 1;
  Visibility visibility_;
  std::vector<Sight> visible_;
  std::vector<Vector3<double>> normals_;  // on the side that sensors see
  std::vector<Correspondence> found_;
  std::size_t n_found_ = 0;
  std::vector<std::uint32_t> guesses_;        // the last measured point of each vertex
  std::vector<std::uint32_t> vertices_near_;  // a vertex near each measured point, if any is known
  std::vector<std::uint32_t> vertices_per_point_;  // how many vertices take each measured point
  PointScan vertices_;                             // the surface itself
  std::vector<Correspondence> drawn_;
  SurfaceComparison comparison_;
};

}  // namespace dynmesh
