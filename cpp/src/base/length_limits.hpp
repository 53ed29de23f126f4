/// The bounds of lengths, without anything that inner loops may not include.
#pragma once

namespace dynmesh {

/// The bounds of squared lengths in squared mean edge lengths. Only outliers reach the upper one.
inline constexpr double squared_length_floor = 1e-12;
inline constexpr double squared_length_ceiling = 1e24;

}  // namespace dynmesh
