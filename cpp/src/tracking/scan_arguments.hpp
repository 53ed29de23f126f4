/// Checks and converts positions of scans and templates, and depth images.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <dynmesh/tracker.hpp>
#include <dynmesh/types.hpp>
#include <limits>
#include <span>
#include <vector>

#include "stream/arguments.hpp"
#include "support/checks.hpp"
#include "support/geometry.hpp"
#include "support/workers.hpp"
#include "tracking/point_scan.hpp"

namespace dynmesh {

/// More points than 32-bit indices can count are refused.
template <class Real>
void check_scan(const char* argument, const Points<const Real>& rows) {
  if (rows.count > static_cast<std::size_t>(std::numeric_limits<Index>::max())) {
    refuse(argument, "has ", rows.count, " rows, more than 32-bit indices can count");
  }
  check_view(argument, rows);
  for (std::size_t i = 0; i < rows.count; ++i) {
    check_position(argument, "row", i, row(rows, i), "all rows must be finite");
  }
}

template <class Real>
std::vector<Vector3<double>> rows_in_double(const Points<const Real>& rows) {
  std::vector<Vector3<double>> copies;
  for (std::size_t i = 0; i < rows.count; ++i) copies.push_back(in_double(row(rows, i)));
  return copies;
}

/// Normals at unit length. Those of length 0 stay 0.
template <class Real>
std::vector<Vector3<double>> directions_of(const Points<const Real>& normals) {
  auto directions = rows_in_double(normals);
  for (auto& normal : directions) {
    // Divided by the largest coordinate first, so that squares stay in range.
    const double largest = std::max({std::abs(normal.x), std::abs(normal.y), std::abs(normal.z)});
    if (!(largest > 0)) continue;
    const Vector3<double> scaled = {normal.x / largest, normal.y / largest, normal.z / largest};
    normal = (1 / std::sqrt(squared_norm(scaled))) * scaled;
  }
  return directions;
}

/// Checks a scan, whose normals and viewpoints may be missing.
template <class Real>
void check_scan(const Scan<Real>& scan) {
  check_scan("points", scan.points);
  if (scan.normals.data != nullptr) {
    if (scan.normals.count != scan.points.count) {
      refuse("normals", "has ", scan.normals.count, " rows, but points has ", scan.points.count);
    }
    check_scan("normals", scan.normals);
  }
  check_scan("viewpoints", scan.viewpoints);
}

/// The points of a scan that has been checked. Normals that are not given are estimated.
template <class Real>
PointScan point_scan_of(const Scan<Real>& scan, Workers& workers) {
  PointScan measured;
  measured.points = rows_in_double(scan.points);
  measured.sensors = rows_in_double(scan.viewpoints);
  if (scan.normals.data != nullptr) {
    measured.normals = directions_of(scan.normals);
  } else {
    measured.estimate_normals(workers);
  }
  return measured;
}

/// Throws std::invalid_argument, which names the number of an image, unless all intrinsics are
/// those of a pinhole camera, all poses are rigid, and no depth is negative.
void check_depth_images(std::span<const DepthImage> images);

/// The points of the pixels of images that have been checked. A normal is that of the differences
/// to the neighbouring pixels of the same surface, which are at most `jump` nearer or farther. A
/// pixel without such a neighbour in its row or in its column says nothing. If there are more than
/// `most` points, only every second, third ... row and column counts.
PointScan point_scan_of(std::span<const DepthImage> images, double jump, std::size_t most);

}  // namespace dynmesh
