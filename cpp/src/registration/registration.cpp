#include <algorithm>
#include <cmath>
#include <dynmesh/registration.hpp>
#include <limits>

#include "registration/constants.hpp"
#include "registration/pose_search.hpp"
#include "stream/arguments.hpp"
#include "stream/stream.hpp"
#include "support/checks.hpp"
#include "support/geometry.hpp"
#include "support/rigid_motion.hpp"
#include "support/workers.hpp"
#include "tracking/point_scan.hpp"
#include "tracking/scan_arguments.hpp"

namespace dynmesh {
namespace {

/// Refuses landmarks that contradict each other, or are not of a template with this many vertices.
template <class Real>
void check_landmarks(const Landmarks<Real>& landmarks, std::size_t n_vertices) {
  if (landmarks.positions.count != landmarks.vertices.size()) {
    refuse("landmarks", "there are ", landmarks.vertices.size(), " vertices, but ",
           landmarks.positions.count, " positions");
  }
  check_scan("landmarks", landmarks.positions);
  const auto position = [&](std::size_t i) { return row(landmarks.positions, i); };
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
      if (squared_norm(position(i) - position(j)) == 0) {
        refuse("landmarks", both, "vertices ", other, " and ", vertex, " are both at ",
               to_text(position(i)));
      }
    }
  }
}

/// Refuses positions that are farther outside the box around a scan than a template of this size
/// can reach, as in another unit or in other axes.
void check_places(std::span<const Vector3<double>> positions, const PointScan& scan, double size) {
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

/// A scan in another unit.
PointScan scaled_scan(const PointScan& scan, double factor) {
  const auto multiplied = [&](std::vector<Vector3<double>> points) {
    for (auto& point : points) point = factor * point;
    return points;
  };
  PointScan scaled;
  scaled.points = multiplied(scan.points);
  scaled.normals = scan.normals;
  scaled.undecided = scan.undecided;
  scaled.sensors = multiplied(scan.sensors);
  scaled.sensor_numbers = scan.sensor_numbers;
  return scaled;
}

/// A template and how it is registered.
template <class Real>
class Work {
 public:
  Work(Faces faces, Points<const Real> positions, const Landmarks<Real>& landmarks,
       const RegistrationSettings& settings, const Training<Real>* training)
      : settings_(settings), workers_(checked(settings).threads, task_sharing_of_tracking()) {
    template_.frame = widened(first_frame_of(positions, "template"));
    topology_ = topology_of(faces, positions.count);
    template_.faces = triangles_of(faces);
    check_landmarks(landmarks, positions.count);
    for (std::size_t i = 0; i < landmarks.vertices.size(); ++i) {
      targets_.add(landmarks.vertices[i], in_double(row(landmarks.positions, i)));
    }
    template_.training = frames_of(training, positions);
  }

  [[nodiscard]] Workers& workers() { return workers_; }
  [[nodiscard]] double mean_edge() const {
    return mean_edge_length<double>(topology_.cells, template_.frame);
  }

  Registration<Real> run(const PointScan& scan) {
    if (scan.size() < TrackingConstants{}.fewest) {
      refuse("points", "there are ", scan.size(), ", but a registration needs at least ",
             TrackingConstants{}.fewest);
    }
    const double size = size_of(template_.frame);
    const double ratio = size > 0 ? size_of(scan.points) / size : 1;  // of the scan to the template
    if (!(ratio > 0) || !std::isfinite(ratio)) {
      refuse("points", "all are at the same position, as far as can be computed");
    }
    const bool is_other_unit = std::max(ratio, 1 / ratio) > AlignmentConstants{}.other_unit;
    if (is_other_unit && !settings_.scale) {
      refuse("points", "are ", to_text(ratio, 4), " times as large as the template; both must be ",
             "in the same unit of length, unless scale is set");
    }
    check_places(targets_.positions, scan, settings_.scale ? ratio * size : size);
    PoseSearch search(template_, topology_, workers_, settings_,
                      std::numeric_limits<Real>::epsilon());
    if (!settings_.scale) return registration_of(search.run(scan, targets_), 1);
    // The search is in the unit of the template.
    double unit = ratio;
    for (int i = 0;; ++i) {
      const PointScan scaled = scaled_scan(scan, 1 / unit);
      Targets targets = targets_;
      for (auto& position : targets.positions) position = 1 / unit * position;
      if (i == registration_constants.scalings)
        return registration_of(search.run(scaled, targets), unit);
      unit *= search.growth(scaled, targets);
    }
  }

 private:
  static const RegistrationSettings& checked(const RegistrationSettings& settings) {
    check_settings(
        TrackerSettings{.threads = settings.threads, .uncertainty = settings.uncertainty});
    return settings;
  }

  /// `unit` is the length of that of the template in that of the scan.
  Registration<Real> registration_of(const Pose& pose, double unit) {
    Registration<Real> result;
    for (const auto& x : pose.x) {
      for (const double c : {x.x, x.y, x.z}) result.vertices.push_back(saturated<Real>(unit * c));
    }
    result.observed = pose.observed;
    for (const double error : pose.standard_errors) {
      result.standard_error.push_back(std::isinf(error) ? std::numeric_limits<Real>::infinity()
                                                        : saturated<Real>(unit * error));
    }
    Eigen::Map<Eigen::Matrix<double, 4, 4, Eigen::RowMajor>> transform(result.transform.data());
    transform = pose.motion.matrix();
    transform.topRows<3>() *= unit;
    result.far_share = pose.agreement.far_share;
    result.unexplained = pose.unexplained;
    result.stretch = pose.stretch;
    result.hole = pose.coverage.hole;
    result.overlap = pose.coverage.overlap;
    result.distance = unit * pose.agreement.distance;
    result.rounds = pose.rounds;
    result.converged = pose.converged;
    result.quality = pose.quality;
    return result;
  }

  RegistrationSettings settings_;
  Workers workers_;
  Topology topology_;
  Template template_;
  Targets targets_;
};

}  // namespace

template <class Real>
Registration<Real> register_template(Faces faces, Points<const Real> positions,
                                     const Scan<Real>& scan, const Landmarks<Real>& landmarks,
                                     const RegistrationSettings& settings,
                                     const Training<Real>* training) {
  Work<Real> work(faces, positions, landmarks, settings, training);
  check_scan(scan);
  return work.run(point_scan_of(scan, work.workers()));
}

template <class Real>
Registration<Real> register_template(Faces faces, Points<const Real> positions,
                                     std::span<const DepthImage> images,
                                     const Landmarks<Real>& landmarks,
                                     const RegistrationSettings& settings,
                                     const Training<Real>* training) {
  Work<Real> work(faces, positions, landmarks, settings, training);
  check_depth_images(images);
  const TrackingConstants constants;
  return work.run(point_scan_of(images, constants.jump * work.mean_edge(),
                                constants.pixels_per_vertex * positions.count));
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
