/// Sizes of point sets in which a few points may lie elsewhere.
#pragma once

#include <dynmesh/types.hpp>
#include <span>
#include <vector>

namespace dynmesh {

/// The value below which this share of the values is, interpolated linearly. There must be one.
double quantile(std::vector<double> values, double share);

/// The median of each coordinate.
Vector3<double> median_of(std::span<const Vector3<double>> points);

/// Twice the distance from the median point within which nine of ten points are.
double size_of(std::span<const Vector3<double>> points);

}  // namespace dynmesh
