/// How the components of a surface behave.
#pragma once

#include <cstdint>
#include <dynmesh/topology.hpp>
#include <dynmesh/types.hpp>
#include <span>
#include <vector>

#include "mesh/clusters.hpp"
#include "surface_fit/constants.hpp"

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

/// (components,) from the shape of frame 0, of which the clusters are.
std::vector<Material> find_materials(std::span<const Triangle> faces, const Topology& topology,
                                     const Clusters& clusters, Field first_frame,
                                     const TrackingConstants& constants);

}  // namespace dynmesh
