/// How well a surface explains what was measured of it.
#pragma once

#include <cstddef>
#include <cstdint>
#include <dynmesh/tracker.hpp>
#include <dynmesh/types.hpp>
#include <span>
#include <vector>

#include "tracking/constants.hpp"
#include "tracking/point_scan.hpp"
#include "tracking/surface_places.hpp"

namespace dynmesh {

/// Of all measured points, and of those of each sensor.
struct Agreements {
  Agreement all;
  std::vector<Agreement> of_sensors;
};

/// Compares measured points with a surface that has these (k,) normals, on the side that the
/// sensors see; where `is_either` (k,) is 1, on both sides. `places` (n,) are those nearest to the
/// points, except for points that are farther than `TrackingConstants::far_distance` mean edges.
Agreements compare(const PointScan& scan, std::span<const Place> places,
                   std::span<const Vector3<double>> normals,
                   std::span<const std::uint8_t> is_either, double mean_edge,
                   const TrackingConstants& constants);

}  // namespace dynmesh
