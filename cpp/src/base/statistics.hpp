/// Medians and quantiles, of numbers and of points.
#pragma once

#include <dynmesh/types.hpp>
#include <span>
#include <vector>

namespace dynmesh {

/// Returns the median, or the mean of the middle two for an even number of values. Reorders
/// `values`, which must not be empty.
double median(std::span<double> values);

/// The value below which this share of the values is, interpolated linearly. There must be one.
double quantile(std::vector<double> values, double share);

/// The median of each coordinate.
Vector3 median_of(Field points);

/// Twice the distance from the median point within which nine of ten points are, since a few points
/// may lie elsewhere.
double size_of(Field points);

}  // namespace dynmesh
