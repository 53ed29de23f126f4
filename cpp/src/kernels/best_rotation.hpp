/// Computes the best rotation for the few covariances for which the fast iteration does not
/// converge.
#pragma once

#include "kernels/rotation_kernels.hpp"

namespace dynmesh {

/// Returns the rotation R with the largest tr(R^T S), as a unit quaternion, for any S whose largest
/// entry is about 1. If several are equally good, returns `found` if it is one of them, and
/// otherwise the one nearest to `last`. Returns `last` if S is not finite.
Quaternion best_rotation(const double (&s)[3][3], const Quaternion& last, const Quaternion& found);

}  // namespace dynmesh
