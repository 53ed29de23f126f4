/// Converts scans.
#pragma once

#include <dynmesh/tracker.hpp>
#include <optional>
#include <string>

#include "arrays.hpp"

namespace dynmesh {

/// Points and, unless they are None, normals and viewpoints.
template <class Real>
class ScanArgument {
 public:
  ScanArgument(const py::object& points, const py::object& normals, const py::object& viewpoints)
      : points_("points", points, "(n, 3)") {
    scan_.points = points_.view();
    if (!normals.is_none()) {
      scan_.normals = normals_.emplace("normals", normals, "(n, 3)").view();
      // An empty array may have no memory, and null would mean that there are no normals.
      if (scan_.normals.count != scan_.points.count) {
        throw py::value_error("normals: has " + std::to_string(scan_.normals.count) +
                              " rows, but points has " + std::to_string(scan_.points.count));
      }
    }
    if (!viewpoints.is_none()) {
      scan_.viewpoints = viewpoints_.emplace("viewpoints", viewpoints, "(c, 3)").view();
    }
  }
  [[nodiscard]] const Scan<Real>& view() const { return scan_; }

 private:
  PointsArgument<Real> points_;
  std::optional<PointsArgument<Real>> normals_, viewpoints_;
  Scan<Real> scan_;
};

}  // namespace dynmesh
