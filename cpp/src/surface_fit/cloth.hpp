/// How the components of a surface behave, and where the surface ends, compared with where the
/// measured points end.
#pragma once

#include <cstdint>
#include <dynmesh/topology.hpp>
#include <dynmesh/types.hpp>
#include <span>
#include <vector>

#include "mesh/clusters.hpp"
#include "surface_fit/constants.hpp"
#include "surface_fit/surface_places.hpp"
#include "surface_fit/surface_rows.hpp"

namespace dynmesh {

/// (k,) whether the component of each vertex is a sheet, whose back can be seen: its boundary has
/// at least as many edges as the square root of the number of its vertices. Smaller holes, as of a
/// neck or of eyes, show little of the inside.
std::vector<std::uint8_t> find_sheets(std::span<const Triangle> faces,
                                      std::span<const Index> component);

/// How a component behaves; docs/reference/tracking.md has the equations.
struct Material {
  bool is_sheet = false;
  /// Whether it is cloth: a sheet that is free to slide, since its own planes do not determine a
  /// rigid motion of it (slippage, Gelfand and Guibas 2004). Masks and cut bodies are sheets whose
  /// shape holds them.
  bool slides = false;
  double pull = 0;          ///< the share of frame 0 in the shape that is wanted
  double membrane = 0;      ///< mu, the weight of the shape of triangles
  double point_weight = 1;  ///< how many times more its points weigh
};

/// (components,) from the shape of frame 0.
std::vector<Material> find_materials(std::span<const Triangle> faces, const Topology& topology,
                                     const Clusters& clusters, Field first_frame,
                                     const TrackingConstants& constants);

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
