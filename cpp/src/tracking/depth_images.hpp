/// Depth images: what cameras measured along the rays of their pixels.
#pragma once

#include <cstddef>
#include <dynmesh/tracker.hpp>
#include <span>

#include "support/workers.hpp"
#include "tracking/point_scan.hpp"

namespace dynmesh {

/// Throws std::invalid_argument, which names the number of an image, unless all intrinsics are
/// those of a pinhole camera, all poses are rigid, and no depth is negative.
void check_depth_images(std::span<const DepthImage> images);

/// Replaces a scan by the points of the pixels of images that have been checked. A normal is that
/// of the differences to the neighbouring pixels of the same surface, which are at most `jump`
/// nearer or farther. A pixel without such a neighbour in its row or in its column says nothing. If
/// there are more than `most` points, only every second, third ... row and column counts.
void convert(std::span<const DepthImage> images, double jump, std::size_t most, Workers& workers,
             PointScan& scan);

}  // namespace dynmesh
