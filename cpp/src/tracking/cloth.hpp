/// Which parts of a surface are sheets, and which of these are cloth.
#pragma once

#include <array>
#include <cstdint>
#include <dynmesh/topology.hpp>
#include <dynmesh/types.hpp>
#include <span>
#include <vector>

#include "tracking/constants.hpp"

namespace dynmesh {

/// The edges of exactly one face, by their ends in ascending order.
std::vector<std::array<Index, 2>> boundary_edges(std::span<const Triangle> faces);

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

}  // namespace dynmesh
