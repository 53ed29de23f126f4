/// The shortest and the longest edges that weights tell apart.
#pragma once

namespace dynmesh {

/// Squared lengths are floored at this many squared mean edges.
inline constexpr double squared_length_floor = 1e-12;
/// And capped here, where the next square would no longer be a float: only an outlier gets there.
inline constexpr double squared_length_ceiling = 1e24;

}  // namespace dynmesh
