/// The rotation that fits best, for the few covariances that the fast iteration cannot settle.
#pragma once

#include "kernels/rotation_kernels.hpp"

namespace dynmesh {

/// The rotation R with the largest tr(R^T S), of unit length, for any S whose largest entry is
/// about one. Of several that are equally good: `found`, if it is one of them, else the one nearest
/// to `last`. It is `last` itself where S is not finite.
Quaternion best_rotation(const double (&s)[3][3], const Quaternion& last, const Quaternion& found);

}  // namespace dynmesh
