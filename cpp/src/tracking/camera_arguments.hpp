/// Checks and converts the depth images of a caller.
#pragma once

#include <cstddef>
#include <dynmesh/tracker.hpp>
#include <span>

#include "tracking/depth_images.hpp"

namespace dynmesh {

/// Throws std::invalid_argument, which names image `number` of the frame, unless its intrinsics are
/// those of a pinhole camera, its pose is rigid, and no depth is negative.
void check_depth_image(std::size_t number, const DepthImage& image);

/// The camera of an image that has been checked.
Camera camera_of(const DepthImage& image);

/// Copies the depths row by row; 0 where nothing was measured.
void copy_depths(const DepthImage& image, std::span<float> depths);

}  // namespace dynmesh
