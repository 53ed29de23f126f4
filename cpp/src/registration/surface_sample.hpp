/// Places spread evenly over a surface, and some of the points of a scan.
#pragma once

#include <cstddef>
#include <dynmesh/types.hpp>
#include <span>
#include <vector>

#include "tracking/point_scan.hpp"

namespace dynmesh {

struct SurfaceSample {
  std::vector<Vector3<double>> points;
  std::vector<Vector3<double>> normals;  ///< of unit length
  std::vector<Index> vertices;           ///< the nearest corner of the face of each point
};

/// n places, always the same, as many for each area; none if there is no area.
SurfaceSample sample_surface(std::span<const Triangle> faces, std::span<const Vector3<double>> x,
                             std::size_t n);

/// About n points of the scan, evenly chosen by their numbers, with their search tree.
PointScan sample_scan(const PointScan& scan, std::size_t n);

}  // namespace dynmesh
