/// The rigid motion that puts a template into a scan, from any rotation and position.
#pragma once

#include <dynmesh/alignment.hpp>
#include <dynmesh/types.hpp>
#include <span>

#include "mesh/triangle.hpp"
#include "tracking/constants.hpp"

namespace dynmesh {

/// As `find_alignment`, for arguments that have been checked and coordinates of at most about 1.
Alignment align(std::span<const Triangle> faces, std::span<const Vector3<double>> first_frame,
                double mean_edge, std::span<const Vector3<double>> scan,
                const AlignmentConstants& constants);

}  // namespace dynmesh
