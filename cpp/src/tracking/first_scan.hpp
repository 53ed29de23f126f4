/// Moves a template rigidly to a first scan that lies elsewhere.
#pragma once

#include <dynmesh/types.hpp>
#include <span>

#include "tracking/constants.hpp"
#include "tracking/correspondences.hpp"
#include "tracking/measurement.hpp"

namespace dynmesh {

/// If the template X is not where the measurement is, moves it there, from centre to centre and
/// then by rigid steps whose radius falls from the size of the template. Returns whether that was
/// needed. `measurement`, in which `correspondences` began a frame, is not empty. Throws
/// std::invalid_argument if it was not possible.
bool move_to_first_scan(const Measurement& measurement, Correspondences& correspondences,
                        const TrackingConstants& constants, double mean_edge,
                        std::span<Vector3<double>> x);

}  // namespace dynmesh
