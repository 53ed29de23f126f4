/// Checks and converts scans and depth images.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <dynmesh/tracker.hpp>
#include <dynmesh/types.hpp>
#include <limits>
#include <span>
#include <vector>

#include "base/arguments.hpp"
#include "base/checks.hpp"
#include "base/geometry.hpp"
#include "base/workers.hpp"
#include "surface_fit/point_scan.hpp"

namespace dynmesh {

/// Rows in double precision. Refuses more than 32-bit indices can count, and positions that are not
/// finite.
template <class Real>
std::vector<Vector3> checked_rows(const char* argument, const Points<const Real>& rows) {
  if (rows.count > static_cast<std::size_t>(std::numeric_limits<Index>::max())) {
    refuse(argument, "has ", rows.count, " rows, more than 32-bit indices can count");
  }
  check_view(argument, rows);
  std::vector<Vector3> checked;
  for (std::size_t i = 0; i < rows.count; ++i) {
    checked.push_back(checked_row(argument, "row", rows, i, "all rows must be finite"));
  }
  return checked;
}

/// A normal at unit length. One of length 0 stays 0.
inline Vector3 direction_of(const Vector3& normal) {
  // Divided by the largest coordinate first, so that squares stay in range.
  const double largest = std::max({std::abs(normal.x), std::abs(normal.y), std::abs(normal.z)});
  if (!(largest > 0)) return normal;
  const Vector3 scaled = {normal.x / largest, normal.y / largest, normal.z / largest};
  return (1 / std::sqrt(squared_norm(scaled))) * scaled;
}

/// Checks and converts a scan, whose normals, viewpoints and colours may be missing. Normals that
/// are not given are estimated, at the scale of a mesh with this mean edge.
template <class Real>
PointScan point_scan_of(const Scan<Real>& scan, double mean_edge, Workers& workers) {
  PointScan measured;
  measured.points = checked_rows("points", scan.points);
  const bool has_normals = scan.normals.data != nullptr;
  const auto check_count = [&](const char* name, const Points<const Real>& rows) {
    if (rows.data == nullptr || rows.count == scan.points.count) return;
    refuse(name, "has ", rows.count, " rows, but points has ", scan.points.count);
  };
  check_count("normals", scan.normals);
  check_count("colours", scan.colours);
  if (has_normals) measured.normals = checked_rows("normals", scan.normals);
  for (auto& normal : measured.normals) normal = direction_of(normal);
  measured.sensors = checked_rows("viewpoints", scan.viewpoints);
  measured.colours = checked_rows("colours", scan.colours);
  if (!has_normals) measured.estimate_normals(mean_edge, workers);
  measured.find_sensors(workers);
  return measured;
}

/// The points of the pixels of images. A normal is that of the differences to the neighbouring
/// pixels of the same surface, which are at most `jump` nearer or farther, or, where the noise of
/// the image hides it, of the plane that fits more pixels around one best. A pixel without such a
/// neighbour in its row or in its column says nothing. If there are more than `most` points, the
/// medians of 2 by 2, 3 by 3 ... pixels take their place, which have less noise.
///
/// Throws std::invalid_argument, which names the number of an image, unless all intrinsics are
/// those of a pinhole camera, all poses are rigid, and no depth is negative.
PointScan point_scan_of(std::span<const DepthImage> images, double jump, std::size_t most);

}  // namespace dynmesh
