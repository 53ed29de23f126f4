/// Rigid motions that may put a template into a scan, and samples of both, which are compared.
#pragma once

#include <Eigen/Geometry>
#include <cstddef>
#include <dynmesh/types.hpp>
#include <span>
#include <vector>

#include "registration/constants.hpp"
#include "surface_fit/point_scan.hpp"

namespace dynmesh {

struct SurfaceSample {
  std::vector<Vector3> points;
  std::vector<Vector3> normals;  ///< of unit length
  std::vector<Index> vertices;   ///< the nearest corner of the face of each point
};

/// n places, always the same, as many for each area; none if there is no area.
SurfaceSample sample_surface(std::span<const Triangle> faces, Field x, std::size_t n);

/// As that of points, of even places; 0 if there is no area. Vertices without faces do not count.
double size_of_surface(std::span<const Triangle> faces, Field x);

/// The area of a surface.
double area_of(std::span<const Triangle> faces, Field x);

/// About the area for which a point of an even sample stands, as its neighbours tell.
double area_around(const PointScan& scan, std::size_t i);

/// Some of the points of a scan.
PointScan part_of(const PointScan& scan, std::span<const std::size_t> numbers);

/// At most about n points of the scan, as many for each area, wherever the sensor was near.
PointScan sample_scan(const PointScan& scan, std::size_t n);

/// The best motions, from any rotation and position, the best one first. They are found by
/// iterative closest points (Besl and McKay 1992) in the six dimensions of position and normal, of
/// which the farthest fifth is ignored (trimmed ICP, Chetverikov et al. 2002). Surfaces with
/// symmetries have several. Where the template is in place already, its motion is the first. Equal
/// input gives equal results. `sample` is one of the scan, with as many points for each area.
std::vector<Eigen::Isometry3d> rigid_starts(std::span<const Triangle> faces, Field surface,
                                            const PointScan& sample);

/// How many times as far from the points, squared, a surface lies where it is, moved a little, as
/// where it lies best among those rotations that differ from this by more than `least_angle`. 1 if
/// there is no area. Takes about 64 times 2 500 nearest neighbours.
double gain_of_turning(std::span<const Triangle> faces, Field surface, const PointScan& sample);

}  // namespace dynmesh
