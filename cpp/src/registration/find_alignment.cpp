#include <Eigen/Geometry>
#include <algorithm>
#include <dynmesh/alignment.hpp>
#include <numbers>
#include <span>
#include <utility>
#include <vector>

#include "base/arguments.hpp"
#include "base/checks.hpp"
#include "base/default_arithmetic.hpp"
#include "base/geometry.hpp"
#include "base/rigid_motion.hpp"
#include "base/statistics.hpp"
#include "base/workers.hpp"
#include "mesh/faces.hpp"
#include "registration/constants.hpp"
#include "registration/rigid_starts.hpp"
#include "surface_fit/point_scan.hpp"
#include "surface_fit/scan_arguments.hpp"

namespace dynmesh {
namespace {

using Motion = Eigen::Isometry3d;

/// A template lies in a scan if typical distances are at most this many mean edges, which a tracker
/// can bridge in one frame, and at most this share of its size, for coarse meshes.
constexpr double within_edges = 5;
constexpr double within_of_size = 0.1;
/// It is turned in place, as a head is that looks backwards, if a rotation by more than this, which
/// a tracker does not bridge surely, makes typical distances so many times smaller.
constexpr double turned_by = std::numbers::pi / 6;
constexpr double turned_distance = 0.5;
/// After the best rigid motion, a template has another pose than the scan, or is another mesh, if
/// typical distances are more than this many mean edges, and more than this share of its size,
/// which the noise of scans of fine meshes does not reach.
constexpr double far_edges = 2.5;
constexpr double far_of_size = 0.02;
/// Of a scan, about so many points are used at most, whose normals are estimated.
constexpr std::size_t most_points = 20000;
/// The share of a surface that a single camera sees at least.
constexpr double seen_share = 0.4;

/// The share of the points that, after a motion, have one of the others within a distance is
/// `share`; returns that distance.
double distance_of(const PointScan& points, double share, const Motion& motion,
                   const PointScan& others) {
  std::vector<double> distances;
  for (const auto& point : points.points) {
    distances.push_back(others.distance(from_eigen(motion * to_eigen(point))));
  }
  return quantile(std::move(distances), share);
}

/// How far the surface is from the scan after a motion; see Alignment.
double distance_between(const PointScan& surface, const Motion& motion, const PointScan& scan) {
  return std::min(distance_of(scan, 0.5, motion.inverse(), surface),
                  distance_of(surface, seen_share, motion, scan));
}

/// The scan has normals.
Alignment align(std::span<const Triangle> faces, Field frame, double mean_edge,
                const PointScan& scan) {
  PointScan surface;
  surface.points = sample_surface(faces, frame, rigid_start_constants.places).points;
  // A surface without an area has vertices.
  if (surface.points.empty()) surface.points.assign(frame.begin(), frame.end());
  const PointScan sample = sample_scan(scan, rigid_start_constants.points);
  const double size = size_of(surface.points);
  const double within = std::min(within_edges * mean_edge, within_of_size * size);
  const double far = std::max(far_edges * mean_edge, far_of_size * size);

  Alignment found;
  found.mean_edge = mean_edge;
  found.ratio = size > 0 ? size_of(sample.points) / size : 1;
  found.other_unit = !(found.ratio < registration_constants.other_unit &&
                       found.ratio > 1 / registration_constants.other_unit);
  const double before = distance_between(surface, Motion::Identity(), sample);
  found.before = found.after = before / mean_edge;
  if (found.other_unit) return found;

  const Motion motion = rigid_starts(faces, frame, sample).front();
  const double after = distance_between(surface, motion, sample);
  const bool is_turned =
      Eigen::AngleAxisd(motion.linear()).angle() > turned_by && after < turned_distance * before;
  found.lies_in_scan = found.matches = before <= within && !is_turned;
  if (found.lies_in_scan) return found;

  Eigen::Map<Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(found.rotation.data()) = motion.linear();
  Eigen::Map<Eigen::Vector3d>(found.shift.data()) = motion.translation();
  found.after = after / mean_edge;
  found.matches = after <= std::min(within, far);
  return found;
}

}  // namespace

template <class Real>
Alignment find_alignment(Faces faces, Points<const Real> first_frame, Points<const Real> scan) {
  const DefaultArithmetic arithmetic;
  const auto frame = first_frame_of(first_frame);
  const Topology topology = checked_topology(faces, frame.size());
  const auto points = checked_rows("scan", scan);
  if (points.empty()) refuse("scan", "has no points");
  const auto triangles = triangles_of(faces);

  PointScan measured;
  const std::size_t step = 1 + points.size() / most_points;
  for (std::size_t i = 0; i < points.size(); i += step) measured.points.push_back(points[i]);
  Workers alone(1);
  const double mean_edge = mean_edge_length(topology.cells, frame);
  measured.estimate_normals(mean_edge, alone);
  return align(triangles, frame, mean_edge, measured);
}

template Alignment find_alignment(Faces, Points<const float>, Points<const float>);
template Alignment find_alignment(Faces, Points<const double>, Points<const double>);

}  // namespace dynmesh
