#include <algorithm>
#include <cmath>
#include <dynmesh/alignment.hpp>
#include <initializer_list>
#include <span>
#include <stdexcept>
#include <vector>

#include "mesh/numbering.hpp"
#include "scans/scan_arguments.hpp"
#include "stream/arguments.hpp"
#include "support/geometry.hpp"
#include "tracking/alignment.hpp"

namespace dynmesh {
namespace {

using Cloud = std::vector<Vector3<double>>;

/// The power of two that is about as large as the largest coordinate. Divided by it, coordinates
/// have squares that are in range, and no digit changes.
double scale_of(std::initializer_list<std::span<const Vector3<double>>> clouds) {
  double largest = 0;
  for (const auto& points : clouds) {
    for (const auto& p : points) {
      largest = std::max({largest, std::abs(p.x), std::abs(p.y), std::abs(p.z)});
    }
  }
  constexpr int most = 1000;  // the inverse of a smaller or larger one is out of range
  return largest > 0 ? std::ldexp(1, std::clamp(std::ilogb(largest), -most, most)) : 1;
}

void multiply(Cloud& points, double factor) {
  for (auto& point : points) point = factor * point;
}

}  // namespace

template <class Real>
Alignment find_alignment(Faces faces, Points<const Real> first_frame, Points<const Real> scan) {
  Cloud frame = widened(first_frame_of(first_frame));
  const Topology topology = topology_of(faces, frame.size());
  check_scan("scan", scan);
  if (scan.count == 0) throw std::invalid_argument("scan: has no points");
  Cloud points;
  copy(scan, points);
  const auto triangles = faces_in_internal_order(faces, {});

  const double scale = scale_of({frame, points});
  multiply(frame, 1 / scale);
  multiply(points, 1 / scale);
  const double mean_edge = mean_edge_length<double>(topology.cells, frame);
  Alignment found = align(triangles, frame, mean_edge, points, {});
  found.mean_edge *= scale;
  for (double& coordinate : found.shift) coordinate *= scale;
  return found;
}

template Alignment find_alignment(Faces, Points<const float>, Points<const float>);
template Alignment find_alignment(Faces, Points<const double>, Points<const double>);

}  // namespace dynmesh
