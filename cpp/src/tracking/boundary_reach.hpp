/// Where the measured surface ends at the boundary of a tracked sheet.
#pragma once

#include <cstdint>
#include <dynmesh/topology.hpp>
#include <dynmesh/types.hpp>
#include <span>
#include <vector>

#include "mesh/triangle.hpp"
#include "support/workers.hpp"
#include "tracking/constants.hpp"
#include "tracking/measurement.hpp"
#include "tracking/point_scan.hpp"
#include "tracking/visibility.hpp"

namespace dynmesh {

/// Where the measured surface ends at a vertex of a boundary. If it ends at the vertex, or if that
/// is not known, `outward` is 0.
struct Reach {
  Vector3<double> outward;  ///< a unit vector along the surface
  Vector3<double> end;      ///< on the line through the vertex, less a margin
};

/// A plane says nothing about where along it a vertex is, so flat cloth is free to slide. Where it
/// has slid, the measured surface extends beyond its boundary on one side, and ends before it on
/// the other.
///
/// Allocates memory only in the constructor.
class BoundaryReach {
 public:
  using Field = std::span<const Vector3<double>>;

  /// `is_cloth` (k,) are the vertices whose boundary is followed. `topology`, `workers` and
  /// `constants` must outlive this object.
  BoundaryReach(std::span<const Triangle> faces, const Topology& topology, Field first_frame,
                std::span<const std::uint8_t> is_cloth, Workers& workers,
                const TrackingConstants& constants);

  /// The surface X, and its normals on the side that sensors see; (k,) each.
  struct Surface {
    Field x;
    Field normals;
    std::span<const Sight> visible;
    const PointScan& index;  ///< of X, with these normals
    double mean_edge;
  };
  /// Finds (k,) the reach of each vertex, valid until the next call.
  std::span<const Reach> find(const Surface& surface, const Measurement& measurement);

 private:
  struct BoundaryVertex {
    std::size_t vertex;
    std::vector<std::size_t> along;  ///< its neighbours on the boundary, two as a rule
    double first_length;             ///< of the sum of its edges in frame 0
  };
  struct Rim;
  [[nodiscard]] Vector3<double> sum_of_edges(std::size_t v, Field x) const;
  [[nodiscard]] Reach reach_of(const BoundaryVertex& b, const Surface& surface,
                               const Measurement& measurement) const;
  [[nodiscard]] double extension(const Rim& rim, const Surface& surface) const;
  [[nodiscard]] double overshoot(const Rim& rim) const;

  const Topology& topology_;
  Workers& workers_;
  const TrackingConstants& constants_;
  std::vector<BoundaryVertex> boundary_;
  std::vector<Reach> reaches_;  // (k,)
};

}  // namespace dynmesh
