/// The unit of length of a scan.
#pragma once

#include <dynmesh/types.hpp>
#include <span>

#include "registration/constants.hpp"
#include "tracking/point_scan.hpp"

namespace dynmesh {

/// The power of ten by which the template must be multiplied; 1 unless it may be scaled. Throws
/// std::invalid_argument if the sizes differ by too much then.
double unit_of(std::span<const Vector3<double>> frame, const PointScan& scan, bool may_scale,
               const RegistrationConstants& constants);

}  // namespace dynmesh
