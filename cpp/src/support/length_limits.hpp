/// The bounds of squared lengths. They are in a separate header because the inner loops use them as
/// well, which may not include inline functions; see lanes.hpp.
#pragma once

namespace dynmesh {

/// The lower bound of squared lengths, in squared mean edge lengths.
inline constexpr double squared_length_floor = 1e-12;
/// The upper bound, above which the square would exceed the range of float. Only outliers reach it.
inline constexpr double squared_length_ceiling = 1e24;

}  // namespace dynmesh
