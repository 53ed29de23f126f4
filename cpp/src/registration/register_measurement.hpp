/// Registration with what was measured, for those who have converted it already.
#pragma once

#include <dynmesh/registration.hpp>
#include <dynmesh/types.hpp>

#include "tracking/point_scan.hpp"

namespace dynmesh {

/// As `register_template`, which see for the arguments and errors, without landmarks and training.
template <class Real>
Registration<Real> register_measurement(Faces faces, Points<const Real> positions,
                                        const PointScan& measured,
                                        const RegistrationSettings& settings);

}  // namespace dynmesh
