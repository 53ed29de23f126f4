#include <algorithm>
#include <cmath>
#include <dynmesh/registration.hpp>
#include <limits>

#include "base/arguments.hpp"
#include "base/checks.hpp"
#include "base/default_arithmetic.hpp"
#include "base/geometry.hpp"
#include "base/rigid_motion.hpp"
#include "base/statistics.hpp"
#include "base/training_frames.hpp"
#include "base/workers.hpp"
#include "mesh/faces.hpp"
#include "registration/constants.hpp"
#include "registration/pose_search.hpp"
#include "registration/rigid_starts.hpp"
#include "surface_fit/point_scan.hpp"
#include "surface_fit/scan_arguments.hpp"

namespace dynmesh {
namespace {

/// Refuses landmarks that contradict each other, or are not of a template with this many vertices.
template <class Real>
Targets targets_of(const Landmarks<Real>& landmarks, std::size_t n_vertices) {
  if (landmarks.positions.count != landmarks.vertices.size()) {
    refuse("landmarks", "there are ", landmarks.vertices.size(), " vertices, but ",
           landmarks.positions.count, " positions");
  }
  const auto positions = checked_rows("landmarks", landmarks.positions);
  Targets targets;
  for (std::size_t i = 0; i < landmarks.vertices.size(); ++i) {
    const Index vertex = landmarks.vertices[i];
    if (vertex < 0 || static_cast<std::size_t>(vertex) >= n_vertices) {
      refuse("landmarks", "landmark ", i, " is of vertex ", vertex, ", but the template has ",
             n_vertices, " vertices, counted from 0");
    }
    for (std::size_t j = 0; j < i; ++j) {
      const Index other = landmarks.vertices[j];
      const auto both = joined("landmarks ", j, " and ", i, " contradict each other: ");
      if (other == vertex) refuse("landmarks", both, "both are of vertex ", vertex);
      if (squared_norm(positions[i] - positions[j]) == 0) {
        refuse("landmarks", both, "vertices ", other, " and ", vertex, " are both at ",
               to_text(positions[i]));
      }
    }
    targets.add(vertex, positions[i]);
  }
  return targets;
}

/// Refuses positions that are farther outside the box around a scan than a template of this size
/// can reach, as in another unit or in other axes.
void check_places(Field positions, const PointScan& scan, double size) {
  Eigen::AlignedBox3d box;
  for (const auto& x : scan.points) box.extend(to_eigen(x));
  for (std::size_t i = 0; i < positions.size(); ++i) {
    const auto& x = positions[i];
    const double distance = box.exteriorDistance(to_eigen(x));
    // No template reaches farther than twice its size beyond what was measured of it.
    if (!(distance > 2 * size)) continue;
    refuse("landmarks", "the position of landmark ", i, ", ", to_text(x, 6), ", is ",
           to_text(distance, 4),
           " outside the scan; it must be in the unit and the axes of the scan");
  }
}

/// How many times as large as a template a scan is. Refuses scans and targets of another unit or
/// place, and too few points.
double checked_ratio(const PointScan& scan, const Targets& targets, const Template& given,
                     bool scale) {
  if (scan.size() < TrackingConstants{}.fewest) {
    refuse("points", "there are ", scan.size(), ", but a registration needs at least ",
           TrackingConstants{}.fewest);
  }
  const double size = size_of_surface(given.faces, given.frame);
  const double ratio = size > 0 ? size_of(scan.points) / size : 1;
  if (!(ratio > 0) || !std::isfinite(ratio)) {
    refuse("points", "all are at the same position, as far as can be computed");
  }
  const bool is_other_unit = std::max(ratio, 1 / ratio) > registration_constants.other_unit;
  if (is_other_unit && !scale) {
    refuse("points", "are ", to_text(ratio, 4), " times as large as the template; both must be ",
           "in the same unit of length, unless scale is set");
  }
  check_places(targets.positions, scan, scale ? ratio * size : size);
  return ratio;
}

/// A scan in another unit.
PointScan scaled(const PointScan& scan, double factor) {
  PointScan other;
  other.points = scan.points;
  other.normals = scan.normals;
  other.undecided = scan.undecided;
  other.sensors = scan.sensors;
  for (auto& point : other.points) point = factor * point;
  for (auto& sensor : other.sensors) sensor = factor * sensor;
  other.sensor_numbers = scan.sensor_numbers;
  return other;
}

Targets scaled(Targets targets, double factor) {
  for (auto& position : targets.positions) position = factor * position;
  return targets;
}

/// `unit` is the length of that of the template in that of the scan.
template <class Real>
Registration<Real> registration_of(const Pose& pose, double unit) {
  Registration<Real> result;
  for (const auto& x : pose.x) {
    for (const double c : {x.x, x.y, x.z}) result.vertices.push_back(saturated<Real>(unit * c));
  }
  result.observed = pose.observed;
  for (const double error : pose.standard_errors) {
    result.standard_error.push_back(saturated_or_infinite<Real>(unit * error));
  }
  Eigen::Map<Eigen::Matrix<double, 4, 4, Eigen::RowMajor>> transform(result.transform.data());
  transform = pose.motion.matrix();
  transform.topRows<3>() *= unit;
  static_cast<Measure&>(result) = pose.measure;
  result.agreement.distance *= unit;
  result.scale = unit;
  result.rounds = pose.rounds;
  result.converged = pose.converged;
  return result;
}

/// `scan_of(workers, mean_edge)` checks and converts the scan.
template <class Real, class ScanOf>
Registration<Real> registered(Faces faces, Points<const Real> positions,
                              const Landmarks<Real>& landmarks,
                              const RegistrationSettings& settings, const Training<Real>* training,
                              const ScanOf& scan_of) {
  const DefaultArithmetic arithmetic;
  check_settings(TrackerSettings{.threads = settings.threads, .uncertainty = settings.uncertainty});
  Workers workers(settings.threads, task_sharing_of_tracking());
  Template given;
  given.frame = first_frame_of(positions, "template");
  const Topology topology = checked_topology(faces, positions.count);
  given.faces = triangles_of(faces);
  const Targets targets = targets_of(landmarks, positions.count);
  if (training != nullptr) given.training = frames_of(*training, given.frame);
  const PointScan scan = scan_of(workers, mean_edge_length(topology.cells, given.frame));
  const double ratio = checked_ratio(scan, targets, given, settings.scale);

  PoseSearch search(given, topology, workers, settings, std::numeric_limits<Real>::epsilon());
  if (!settings.scale) return registration_of<Real>(search.run(scan, targets), 1);
  // The search is in the unit of the template.
  double unit = ratio;
  for (int i = 0; i < registration_constants.scalings; ++i) {
    unit *= search.growth(scaled(scan, 1 / unit), scaled(targets, 1 / unit));
  }
  return registration_of<Real>(search.run(scaled(scan, 1 / unit), scaled(targets, 1 / unit)), unit);
}

}  // namespace

template <class Real>
Registration<Real> register_template(Faces faces, Points<const Real> positions,
                                     const Scan<Real>& scan, const Landmarks<Real>& landmarks,
                                     const RegistrationSettings& settings,
                                     const Training<Real>* training) {
  return registered(
      faces, positions, landmarks, settings, training,
      [&](Workers& workers, double mean_edge) { return point_scan_of(scan, mean_edge, workers); });
}

template <class Real>
Registration<Real> register_template(Faces faces, Points<const Real> positions,
                                     std::span<const DepthImage> images,
                                     const Landmarks<Real>& landmarks,
                                     const RegistrationSettings& settings,
                                     const Training<Real>* training) {
  const TrackingConstants constants;
  return registered(faces, positions, landmarks, settings, training,
                    [&](Workers& /*workers*/, double mean_edge) {
                      return point_scan_of(images, constants.jump * mean_edge,
                                           constants.pixels_per_vertex * positions.count);
                    });
}

template Registration<float> register_template(Faces, Points<const float>, const Scan<float>&,
                                               const Landmarks<float>&, const RegistrationSettings&,
                                               const Training<float>*);
template Registration<double> register_template(Faces, Points<const double>, const Scan<double>&,
                                                const Landmarks<double>&,
                                                const RegistrationSettings&,
                                                const Training<double>*);
template Registration<float> register_template(Faces, Points<const float>,
                                               std::span<const DepthImage>, const Landmarks<float>&,
                                               const RegistrationSettings&, const Training<float>*);
template Registration<double> register_template(Faces, Points<const double>,
                                                std::span<const DepthImage>,
                                                const Landmarks<double>&,
                                                const RegistrationSettings&,
                                                const Training<double>*);

}  // namespace dynmesh
