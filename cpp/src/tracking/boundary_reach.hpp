/// How far the measured surface extends beyond the boundary of a tracked sheet.
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

/// Where the measured surface ends beyond a vertex of a boundary. A distance of 0 means that it
/// does not end there, or not beyond the vertex.
struct Reach {
  Vector3<double> outward;  ///< a unit vector along the surface
  double distance = 0;      ///< from the vertex to the end, less a margin
};

/// A plane says nothing about where along it a vertex is, so flat cloth is free to slide. Where it
/// has slid, the measured surface extends beyond its boundary on one side, and ends there.
///
/// Allocates memory only in the constructor.
class BoundaryReach {
 public:
  using Field = std::span<const Vector3<double>>;

  /// `is_cloth` (k,) are the vertices whose boundary is followed. `topology`, `workers` and
  /// `constants` must outlive this object.
  BoundaryReach(std::span<const Triangle> faces, const Topology& topology,
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
  [[nodiscard]] Reach reach_of(std::size_t v, const Surface& surface,
                               const Measurement& measurement) const;

  const Topology& topology_;
  Workers& workers_;
  const TrackingConstants& constants_;
  std::vector<Index> vertices_;  // of the boundaries
  std::vector<Reach> reaches_;   // (k,)
};

}  // namespace dynmesh
