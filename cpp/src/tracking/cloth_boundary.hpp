/// Where cloth ends, compared with where the measured points end.
#pragma once

#include <cstddef>
#include <cstdint>
#include <dynmesh/topology.hpp>
#include <dynmesh/types.hpp>
#include <span>
#include <vector>

#include "tracking/constants.hpp"
#include "tracking/surface_places.hpp"
#include "tracking/surface_rows.hpp"

namespace dynmesh {

/// Cloth slides along itself without leaving the planes of its points; its boundary must lie where
/// the points end.
class ClothBoundary {
 public:
  using Field = std::span<const Vector3<double>>;

  /// All arguments must outlive this object. (k,) `is_cloth` are the vertices of cloth.
  ClothBoundary(std::span<const Triangle> faces, const Topology& topology, double mean_edge,
                std::span<const std::uint8_t> is_cloth, const TrackingConstants& constants);

  /// Whether a place is on the boundary of cloth.
  [[nodiscard]] bool contains(const Place& place) const;

  /// Adds to the rows of points those that draw the boundary of X: outwards to the points whose
  /// place is on it, and inwards where it lies beyond the last point. `normals` (k,) are those of
  /// X.
  void draw(Field x, Field normals, std::vector<SurfaceRow>& rows) const;

 private:
  [[nodiscard]] Vector3<double> conormal(std::uint32_t vertex, Field x, Field normals) const;

  const Topology& topology_;
  const TrackingConstants& constants_;
  double mean_edge_;
  std::vector<std::uint8_t> side_is_boundary_;  // of each corner of a face: of the side opposite
  std::vector<std::uint8_t> is_boundary_;       // (k,)
};

}  // namespace dynmesh
