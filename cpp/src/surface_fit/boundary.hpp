/// Where a surface ends, compared with where the measured points end.
#pragma once

#include <cstdint>
#include <dynmesh/topology.hpp>
#include <dynmesh/types.hpp>
#include <span>
#include <vector>

#include "surface_fit/constants.hpp"
#include "surface_fit/materials.hpp"
#include "surface_fit/surface_places.hpp"
#include "surface_fit/surface_rows.hpp"

namespace dynmesh {

/// A surface slides along itself without leaving the planes of its points. Only its boundary shows
/// by how much: it must lie where the points end.
class Boundary {
 public:
  /// All arguments must outlive this object.
  Boundary(std::span<const Triangle> faces, const Topology& topology, double mean_edge,
           std::span<const Material> materials, const TrackingConstants& constants);

  /// Adds to the rows of points those that draw the boundary of X: outwards to the points whose
  /// place is on it, and that of cloth inwards where it lies beyond the last point. X has the
  /// `normals` (k,).
  void draw(Field x, Field normals, std::vector<SurfaceRow>& rows) const;

 private:
  [[nodiscard]] bool contains(const Place& place) const;
  [[nodiscard]] Vector3 conormal(std::uint32_t vertex, Field x, Field normals) const;

  const Topology& topology_;
  const TrackingConstants& constants_;
  double mean_edge_;
  std::vector<std::uint32_t> next_sides_;
  std::span<const Material> materials_;
  std::vector<std::uint8_t> is_boundary_;  // (k,)
};

}  // namespace dynmesh
