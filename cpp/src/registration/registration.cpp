#include <algorithm>
#include <array>
#include <cmath>
#include <cstdio>
#include <dynmesh/registration.hpp>
#include <limits>
#include <memory>
#include <stdexcept>
#include <string>

#include "registration/constants.hpp"
#include "registration/pose.hpp"
#include "registration/pose_search.hpp"
#include "registration/register_measurement.hpp"
#include "registration/targets.hpp"
#include "stream/arguments.hpp"
#include "stream/stream.hpp"
#include "support/geometry.hpp"
#include "support/workers.hpp"
#include "tracking/depth_images.hpp"
#include "tracking/point_scan.hpp"
#include "tracking/scan_arguments.hpp"

namespace dynmesh {
namespace {

/// How many times as large as the template the scan is.
double ratio_of_sizes(std::span<const Vector3<double>> frame, const PointScan& scan) {
  const double size = size_of(frame);
  const double ratio = size > 0 ? size_of(scan.points) / size : 1;
  if (!(ratio > 0) || !std::isfinite(ratio)) {
    throw std::invalid_argument("points: all are at the same position, as far as can be computed");
  }
  return ratio;
}

void refuse_ratio(double ratio) {
  std::array<char, 200> text{};
  (void)std::snprintf(text.data(), text.size(),
                      "points: are %.4g times as large as the template; both must be in the same "
                      "unit of length, unless scale is set",
                      ratio);
  throw std::invalid_argument(text.data());
}

/// A scan in another unit, with its search tree.
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
  scaled.index();
  return scaled;
}

/// A template and how it is registered.
template <class Real>
class Work {
 public:
  Work(Faces faces, Points<const Real> positions, const Landmarks<Real>& landmarks,
       const RegistrationSettings& settings, const Training<Real>* training)
      : settings_(settings), workers_(checked(settings).threads) {
    const auto given = widened(first_frame_of(positions, "template"));
    topology_ = topology_of(faces, given.size());
    template_.faces = triangles_of(faces);
    template_.frame = given;
    check_landmarks(landmarks, given.size());
    for (std::size_t i = 0; i < landmarks.vertices.size(); ++i) {
      targets_.vertices.push_back(landmarks.vertices[i]);
      targets_.positions.push_back(in_double(row(landmarks.positions, i)));
    }
    if (training == nullptr) return;
    check_training(*training, given.size());
    check_size(*training, positions);
    template_.training = training_in_double(training->frames());
  }

  [[nodiscard]] Workers& workers() { return workers_; }
  [[nodiscard]] double mean_edge() const {
    return mean_edge_length<double>(topology_.cells, template_.frame);
  }

  Registration<Real> run(const PointScan& scan) {
    if (scan.size() < TrackingConstants{}.fewest) {
      throw std::invalid_argument("points: there are " + std::to_string(scan.size()) +
                                  ", but a registration needs at least " +
                                  std::to_string(TrackingConstants{}.fewest));
    }
    if (!scan.is_indexed()) scan.index();
    const double ratio = ratio_of_sizes(template_.frame, scan);
    const bool is_other_unit = std::max(ratio, 1 / ratio) > AlignmentConstants{}.other_unit;
    if (is_other_unit && !settings_.scale) refuse_ratio(ratio);
    const double size = size_of(template_.frame);
    check_places(targets_.positions, scan, settings_.scale ? ratio * size : size);
    PoseSearch search(template_, topology_, workers_, settings_, constants_,
                      std::numeric_limits<Real>::epsilon());
    if (!settings_.scale) return registration_of(search.run(scan, targets_), 1);
    // The search is in the unit of the template.
    double unit = ratio;
    for (int i = 0;; ++i) {
      const PointScan scaled = scaled_scan(scan, 1 / unit);
      Targets targets = targets_;
      for (auto& position : targets.positions) position = 1 / unit * position;
      if (i == constants_.scalings) return registration_of(search.run(scaled, targets), unit);
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
    if (!pose.standard_errors.empty()) {
      for (const double error : pose.standard_errors) {
        result.standard_error.push_back(std::isinf(error) ? std::numeric_limits<Real>::infinity()
                                                          : saturated<Real>(unit * error));
      }
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

  RegistrationConstants constants_;
  RegistrationSettings settings_;
  Workers workers_;
  Topology topology_;
  Template template_;
  Targets targets_;
};

}  // namespace

template <class Real>
Registration<Real> register_measurement(Faces faces, Points<const Real> positions,
                                        const PointScan& measured,
                                        const RegistrationSettings& settings) {
  return Work<Real>(faces, positions, {}, settings, nullptr).run(measured);
}

template Registration<float> register_measurement(Faces, Points<const float>, const PointScan&,
                                                  const RegistrationSettings&);
template Registration<double> register_measurement(Faces, Points<const double>, const PointScan&,
                                                   const RegistrationSettings&);

template <class Real>
Registration<Real> register_template(Faces faces, Points<const Real> positions,
                                     const Scan<Real>& scan, const Landmarks<Real>& landmarks,
                                     const RegistrationSettings& settings,
                                     const Training<Real>* training) {
  Work<Real> work(faces, positions, landmarks, settings, training);
  check_scan(scan);
  PointScan measured;
  copy(scan, measured, work.workers());
  return work.run(measured);
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
  PointScan scan;
  convert(images, constants.jump * work.mean_edge(), constants.pixels_per_vertex * positions.count,
          work.workers(), scan);
  return work.run(scan);
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
