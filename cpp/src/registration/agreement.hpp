/// How well a surface explains a scan.
#pragma once

#include <dynmesh/types.hpp>
#include <span>

#include "mesh/triangle.hpp"
#include "registration/constants.hpp"
#include "support/workers.hpp"
#include "tracking/measurement.hpp"

namespace dynmesh {

struct Agreement {
  double far_share = 0;    ///< the share of the points that are far from the surface
  double disagreeing = 0;  ///< the share of those near it whose normal is another
  double distance = 0;     ///< root mean square of the points that are near the surface
};

/// Compares points with the nearest places of the surface. `far` is a length.
Agreement agreement_of(std::span<const Triangle> faces, std::span<const Vector3<double>> x,
                       const Measurement& scan, double far, const RegistrationConstants& constants,
                       Workers& workers);

}  // namespace dynmesh
