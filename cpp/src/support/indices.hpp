/// Index, which is signed and has 32 bits, as the subscript of a std::vector.
#pragma once

#include <cstddef>
#include <dynmesh/types.hpp>

namespace dynmesh {

/// Where an index is missing.
constexpr Index none = -1;

constexpr std::size_t at(Index i) { return static_cast<std::size_t>(i); }

}  // namespace dynmesh
