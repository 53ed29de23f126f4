/// Which parts of a tracked surface are cloth.
#pragma once

#include <cstdint>
#include <dynmesh/topology.hpp>
#include <dynmesh/types.hpp>
#include <span>
#include <vector>

#include "mesh/triangle.hpp"
#include "tracking/constants.hpp"

namespace dynmesh {

/// (k,) whether the component of each vertex is cloth: a sheet that is free to slide, since its own
/// planes do not determine a rigid motion of it (slippage, Gelfand and Guibas 2004). Masks and cut
/// bodies are sheets whose shape holds them.
std::vector<std::uint8_t> find_cloth(std::span<const Triangle> faces,
                                     std::span<const Index> component,
                                     std::span<const Vector3<double>> first_frame,
                                     const TrackingConstants& constants);

}  // namespace dynmesh
