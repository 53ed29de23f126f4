#pragma once

#include <array>
#include <dynmesh/types.hpp>

namespace dynmesh {

/// The vertices of a face, counterclockwise as seen from outside.
using Triangle = std::array<Index, 3>;

}  // namespace dynmesh
