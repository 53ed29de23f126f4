/// Between what bounds squared lengths count. By themselves, so that the inner loops can use them
/// too: these may not include anything with inline functions, see lanes.hpp.
#pragma once

namespace dynmesh {

/// Squared lengths are floored at this many squared mean edges.
inline constexpr double squared_length_floor = 1e-12;
/// And capped here, where the next square would no longer be a float: only an outlier gets there.
inline constexpr double squared_length_ceiling = 1e24;

}  // namespace dynmesh
