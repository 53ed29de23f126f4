/// Which parts of a surface are sheets, which of these are cloth, and where the surface ends,
/// compared with where the measured points end.
#pragma once

#include <cstdint>
#include <dynmesh/topology.hpp>
#include <dynmesh/types.hpp>
#include <span>
#include <vector>

#include "surface_fit/constants.hpp"
#include "surface_fit/surface_places.hpp"
#include "surface_fit/surface_rows.hpp"

namespace dynmesh {

/// (k,) whether the component of each vertex is a sheet, whose back can be seen: its boundary has
/// at least as many edges as the square root of the number of its vertices. Smaller holes, as of a
/// neck or of eyes, show little of the inside.
std::vector<std::uint8_t> find_sheets(std::span<const Triangle> faces,
                                      std::span<const Index> component);

/// (k,) whether the component of each vertex is cloth: a sheet that is free to slide, since its own
/// planes do not determine a rigid motion of it (slippage, Gelfand and Guibas 2004). Masks and cut
/// bodies are sheets whose shape holds them.
std::vector<std::uint8_t> find_cloth(std::span<const Triangle> faces,
                                     std::span<const Index> component,
                                     std::span<const Vector3<double>> first_frame,
                                     const TrackingConstants& constants);

/// A surface slides along itself without leaving the planes of its points, and only its boundary
/// tells: it must lie where the points end.
class Boundary {
 public:
  using Field = std::span<const Vector3<double>>;

  /// All arguments must outlive this object. (k,) `is_cloth` are the vertices of cloth.
  Boundary(std::span<const Triangle> faces, const Topology& topology, double mean_edge,
           std::span<const std::uint8_t> is_cloth, const TrackingConstants& constants);

  /// Adds to the rows of points those that draw the boundary of X: outwards to the points whose
  /// place is on it, and that of cloth inwards where it lies beyond the last point. `normals` (k,)
  /// are those of X.
  void draw(Field x, Field normals, std::vector<SurfaceRow>& rows) const;

 private:
  [[nodiscard]] bool contains(const Place& place) const;
  [[nodiscard]] Vector3<double> conormal(std::uint32_t vertex, Field x, Field normals) const;

  const Topology& topology_;
  const TrackingConstants& constants_;
  double mean_edge_;
  std::vector<std::uint32_t> next_sides_;
  std::span<const std::uint8_t> is_cloth_;
  std::vector<std::uint8_t> is_boundary_;  // (k,)
};

}  // namespace dynmesh
