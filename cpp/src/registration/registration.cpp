#include <cmath>
#include <dynmesh/registration.hpp>
#include <limits>
#include <stdexcept>
#include <string>

#include "mesh/training_frames.hpp"
#include "registration/constants.hpp"
#include "registration/pose.hpp"
#include "registration/pose_search.hpp"
#include "registration/register_measurement.hpp"
#include "registration/targets.hpp"
#include "registration/unit.hpp"
#include "scans/camera_arguments.hpp"
#include "scans/scan_arguments.hpp"
#include "stream/arguments.hpp"
#include "stream/stream.hpp"
#include "tracking/depth_images.hpp"
#include "tracking/point_scan.hpp"
#include "tracking/robust_size.hpp"

namespace dynmesh {
namespace {

/// A template and how it is registered.
template <class Real>
class Work {
 public:
  Work(Faces faces, Points<const Real> positions, const Landmarks<Real>& landmarks,
       const RegistrationSettings& settings, const Training<Real>* training)
      : settings_(settings), stream_(stream_of(faces, positions, settings)) {
    template_.faces = faces_in_internal_order(faces, stream_.numbering);
    template_.frame =
        to_internal_order(stream_.numbering, widened(first_frame_of(positions, "template")));
    check_landmarks(landmarks, stream_.n_vertices());
    for (std::size_t i = 0; i < landmarks.vertices.size(); ++i) {
      const auto vertex = static_cast<std::size_t>(landmarks.vertices[i]);
      targets_.vertices.push_back(static_cast<Index>(stream_.numbering.internal_index(vertex)));
      targets_.positions.push_back(in_double(row(landmarks.positions, i)));
    }
    if (training == nullptr) return;
    check_training(*training, stream_.n_vertices());
    check_size(*training, positions);
    template_.training = take_in_internal_order(training->frames(), stream_.numbering);
  }

  [[nodiscard]] Workers& workers() { return stream_.workers; }
  [[nodiscard]] double mean_edge() const {
    return mean_edge_length<double>(stream_.topology->cells, template_.frame);
  }

  Registration<Real> run(const PointScan& scan) {
    if (scan.size() < constants_.fewest_points) {
      throw std::invalid_argument("points: there are " + std::to_string(scan.size()) +
                                  ", but a registration needs at least " +
                                  std::to_string(constants_.fewest_points));
    }
    if (!scan.is_indexed()) scan.index();
    const double unit = unit_of(template_.frame, scan, settings_.scale, constants_);
    for (auto& x : template_.frame) x = unit * x;
    check_places(targets_.positions, scan, size_of(template_.frame), constants_);
    for (auto& frame : template_.training) {
      for (auto& x : frame) x = unit * x;
    }
    PoseSearch search(template_, targets_, settings_, std::numeric_limits<Real>::epsilon(), stream_,
                      constants_);
    return registration_of(search.run(scan), unit);
  }

 private:
  static Stream<double> stream_of(Faces faces, Points<const Real> positions,
                                  const RegistrationSettings& settings) {
    check_settings(
        TrackerSettings{.threads = settings.threads, .uncertainty = settings.uncertainty});
    const auto given = widened(first_frame_of(positions, "template"));
    return {given, topology_of(faces, given.size()), DisconnectedRule::follow, settings.threads,
            settings.uncertainty};
  }

  Registration<Real> registration_of(const Pose& pose, double unit) {
    Registration<Real> result;
    for (const auto& x : to_caller_order(stream_.numbering, pose.x)) {
      for (const double c : {x.x, x.y, x.z}) result.vertices.push_back(saturated<Real>(c));
    }
    result.observed = pose.observed;
    for (const double error : pose.standard_errors) {
      result.standard_error.push_back(std::isinf(error) ? std::numeric_limits<Real>::infinity()
                                                        : saturated<Real>(error));
    }
    Eigen::Map<Eigen::Matrix<double, 4, 4, Eigen::RowMajor>> transform(result.transform.data());
    transform = pose.motion.matrix();
    transform.topLeftCorner<3, 3>() *= unit;
    result.far_share = pose.agreement.far_share;
    result.disagreeing = pose.agreement.disagreeing;
    result.empty_share = pose.coverage.empty_share;
    result.hole = pose.coverage.hole;
    result.overlap = pose.coverage.overlap;
    result.stretched = pose.coverage.stretched;
    result.distance = pose.agreement.distance;
    result.rounds = pose.rounds;
    result.converged = pose.converged;
    result.ambiguous = pose.ambiguous;
    result.quality = pose.quality;
    return result;
  }

  RegistrationConstants constants_;
  RegistrationSettings settings_;
  Stream<double> stream_;
  ScaledTemplate template_;
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
  DepthImages measured;
  for (std::size_t i = 0; i < images.size(); ++i) check_depth_image(i, images[i]);
  for (const DepthImage& image : images) {
    copy_depths(image, measured.add(camera_of(image), image.height, image.width));
  }
  const TrackingConstants constants;
  PointScan scan;
  measured.convert(constants.jump * work.mean_edge(), constants.pixels_per_vertex * positions.count,
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
