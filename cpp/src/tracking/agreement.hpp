/// How well a surface explains what was measured of it.
#pragma once

#include <cstddef>
#include <cstdint>
#include <dynmesh/topology.hpp>
#include <dynmesh/tracker.hpp>
#include <dynmesh/types.hpp>
#include <span>
#include <vector>

#include "mesh/triangle.hpp"
#include "support/workers.hpp"
#include "tracking/constants.hpp"
#include "tracking/measurement.hpp"
#include "tracking/visibility.hpp"

namespace dynmesh {

/// Of all measured points, and of those of each sensor.
struct Agreements {
  Agreement all;
  std::vector<Agreement> of_sensors;
};

/// Finds how far measured points are from a surface whose positions change.
class SurfaceComparison {
 public:
  using Field = std::span<const Vector3<double>>;

  /// All arguments must outlive this object.
  SurfaceComparison(std::span<const Triangle> faces, const Cells& cells, Workers& workers,
                    const TrackingConstants& constants);

  struct Surface {
    Field x;                         ///< (k,)
    Field normals;                   ///< (k,) at the vertices, on the side that the sensors see
    std::span<const Sight> visible;  ///< (k,), or empty: the front of all
    double mean_edge = 1;
  };
  /// `near` has a vertex that may be near each point of the scan, or `Measurement::no_guess`; or it
  /// is empty. Good ones save most of the time. About `examined_points` points are compared.
  [[nodiscard]] Agreements compare(const Surface& surface, const Measurement& scan,
                                   std::span<const std::uint32_t> near) const;

  /// Every so manyth point of a scan is compared.
  [[nodiscard]] std::size_t stride_of(const Measurement& scan) const {
    return 1 + scan.size() / static_cast<std::size_t>(constants_.examined_points);
  }

 private:
  struct Place {
    std::size_t vertex = 0;  ///< a vertex beside the place
    double squared = 0;      ///< of the distance in mean edges
  };
  struct Local;
  [[nodiscard]] Place nearest_around(const Local& local, std::size_t vertex) const;
  [[nodiscard]] std::size_t walk(const Local& local, std::size_t start) const;
  [[nodiscard]] bool agrees(const Surface& surface, const Measurement& scan, std::size_t point,
                            std::size_t vertex) const;

  std::span<const Triangle> faces_;
  const Cells& cells_;
  Workers& workers_;
  const TrackingConstants& constants_;
  // The faces around vertex v are those from ends_[v] to ends_[v + 1].
  std::vector<std::uint32_t> ends_;
  std::vector<std::uint32_t> faces_around_;
};

}  // namespace dynmesh
