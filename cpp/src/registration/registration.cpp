#include <algorithm>
#include <cmath>
#include <dynmesh/registration.hpp>
#include <limits>
#include <stdexcept>
#include <string>
#include <utility>

#include "mesh/training_frames.hpp"
#include "registration/candidates.hpp"
#include "registration/coarse_fit.hpp"
#include "registration/coarse_mesh.hpp"
#include "registration/coverage.hpp"
#include "registration/fine_rounds.hpp"
#include "registration/register_measurement.hpp"
#include "registration/surface_sample.hpp"
#include "registration/targets.hpp"
#include "registration/unit.hpp"
#include "scans/camera_arguments.hpp"
#include "scans/scan_arguments.hpp"
#include "stream/arguments.hpp"
#include "support/eigen_points.hpp"
#include "tracking/agreement.hpp"
#include "tracking/depth_images.hpp"
#include "tracking/point_scan.hpp"
#include "tracking/robust_size.hpp"
#include "tracking/vertex_normals.hpp"
#include "tracking/visibility.hpp"

namespace dynmesh {
namespace {

using Cloud = std::vector<Vector3<double>>;
using Field = std::span<const Vector3<double>>;
using Motion = Eigen::Isometry3d;

void check(const RegistrationSettings& settings) {
  check_settings(TrackerSettings{.threads = settings.threads, .uncertainty = settings.uncertainty});
}

Cloud moved(const Motion& motion, Field frame) {
  Cloud result(frame.size());
  std::ranges::transform(frame, result.begin(),
                         [&](const auto& x) { return from_eigen(motion * to_eigen(x)); });
  return result;
}

/// A template and how it is registered.
template <class Real>
class Work {
 public:
  Work(Faces faces, Points<const Real> positions, const Landmarks<Real>& landmarks,
       const RegistrationSettings& settings, const Training<Real>* training)
      : settings_(settings),
        given_(widened(first_frame_of(positions, "template"))),
        stream_(given_, topology_of(faces, given_.size()), DisconnectedRule::follow,
                checked(settings).threads, settings.uncertainty),
        faces_(faces_in_internal_order(faces, stream_.numbering)),
        frame_(to_internal_order(stream_.numbering, given_)),
        comparison_(faces_, stream_.topology->cells, stream_.workers, tracking_) {
    check_landmarks(landmarks, given_.size());
    for (std::size_t i = 0; i < landmarks.vertices.size(); ++i) {
      const auto vertex = static_cast<std::size_t>(landmarks.vertices[i]);
      targets_.vertices.push_back(static_cast<Index>(stream_.numbering.internal_index(vertex)));
      targets_.positions.push_back(in_double(row(landmarks.positions, i)));
    }
    if (training == nullptr) return;
    check_training(*training, given_.size());
    check_size(*training, positions);
    training_ = take_in_internal_order(training->frames(), stream_.numbering);
  }

  [[nodiscard]] Workers& workers() { return stream_.workers; }
  [[nodiscard]] double mean_edge() const {
    return mean_edge_length<double>(stream_.topology->cells, frame_);
  }

  Registration<Real> run(const Measurement& scan) {
    if (scan.size() < constants_.fewest_points) {
      throw std::invalid_argument("points: there are " + std::to_string(scan.size()) +
                                  ", but a registration needs at least " +
                                  std::to_string(constants_.fewest_points));
    }
    const double unit = unit_of(frame_, scan, settings_.scale, constants_);
    for (auto& x : frame_) x = unit * x;
    for (auto& frame : training_) {
      for (auto& x : frame) x = unit * x;
    }
    CoarseMesh mesh = coarse_mesh_of(faces_, frame_, constants_.most_coarse_vertices);
    CoarseFit coarse(mesh, workers(), constants_);
    FineRounds rounds(faces_, stream_, training_, settings_.uncertainty,
                      std::numeric_limits<Real>::epsilon(), constants_, constants_.fine());
    auto registration = best_of(candidates(scan), mesh, coarse, rounds, scan);
    const auto try_others = [&](std::vector<Candidate> others) {
      if (others.empty()) return;
      auto other = best_of(std::move(others), mesh, coarse, rounds, scan);
      if (rank_of(other) < rank_of(registration)) registration = std::move(other);
    };
    // Landmarks on limbs that have moved say little about the motion of the whole.
    if (settings_.align && targets_.determine_a_rotation() &&
        registration.quality != RegistrationQuality::good) {
      try_others(candidates_by_points(shape(), scan, targets_.landmarks_of(frame_), constants_));
    }
    // By one sensor, limbs end where it does not see them.
    const bool has_tips =
        settings_.align && targets_.vertices.empty() && scan.viewpoints().size() != 1;
    if (has_tips && registration.far_share > constants_.doubtful_far &&
        registration.far_share < constants_.tips.largest_far) {
      try_tips(scan, registration, try_others);
    }
    draw_out(scan, registration);
    Eigen::Map<Eigen::Matrix<double, 4, 4, Eigen::RowMajor>> transform(
        registration.transform.data());
    transform.topLeftCorner<3, 3>() *= unit;
    return registration;
  }

 private:
  static const RegistrationSettings& checked(const RegistrationSettings& settings) {
    check(settings);
    return settings;
  }

  [[nodiscard]] std::vector<Candidate> candidates(const Measurement& scan) const {
    const auto landmarks = targets_.landmarks_of(frame_);
    if (!settings_.align) return {{Motion::Identity(), landmarks}};
    if (targets_.determine_a_rotation()) return {{targets_.motion_from(frame_), landmarks}};
    return candidates_by_points(shape(), scan, landmarks, constants_);
  }

  [[nodiscard]] TemplateShape shape() const { return {faces_, frame_, mean_edge()}; }

  /// Brings the tips of limbs to those of the scan, and then those that it left out.
  template <class Try>
  void try_tips(const Measurement& scan, Registration<Real>& best, const Try& try_others) {
    const TipConstants& c = constants_.tips;
    const auto is_good = [&] { return best.quality == RegistrationQuality::good; };
    std::vector<Registration<Real>> by_tips;
    for (std::size_t i = 0; i < c.points.size() && !is_good(); ++i) {
      const TipsOfBoth tips = tips_of_both(shape(), scan, c.points[i], c);
      try_others(candidates_by_tips(shape(), tips, c));
      if (by_tips.empty() || by_tips.back().vertices != best.vertices) by_tips.push_back(best);
      double before = std::numeric_limits<double>::infinity();
      for (int repair = 0; repair < c.repairs && !is_good() && best.far_share < before; ++repair) {
        before = best.far_share;
        const Candidate found = candidate_of(best);
        try_others(candidates_by_tips_left_out(shape(), tips, found.motion, found.x, c));
      }
    }
    // Last, because it covers the points also where legs are exchanged.
    for (Registration<Real>& other : by_tips) {
      if (is_good()) return;
      draw_out(scan, other);
      if (rank_of(other) < rank_of(best)) best = std::move(other);
    }
  }

  /// The motion of a result, and its vertices.
  [[nodiscard]] Candidate candidate_of(const Registration<Real>& registration) const {
    Candidate candidate;
    candidate.motion.matrix() = Eigen::Map<const Eigen::Matrix<double, 4, 4, Eigen::RowMajor>>(
        registration.transform.data());
    const std::span<const std::vector<Real>> found(&registration.vertices, 1);
    candidate.x = take_in_internal_order(found, stream_.numbering).front();
    return candidate;
  }

  /// Draws every vertex towards the points that none explains, also those that lie on the scan
  /// already, such as a nose that was pushed into the head, and keeps what is better.
  void draw_out(const Measurement& scan, Registration<Real>& registration) {
    if (registration.ambiguous || registration.far_share <= constants_.doubtful_far ||
        registration.far_share >= constants_.ruined_far) {
      return;
    }
    FineRounds rounds(faces_, stream_, training_, settings_.uncertainty,
                      std::numeric_limits<Real>::epsilon(), constants_, constants_.drawing());
    auto other = finished(candidate_of(registration), rounds, scan);
    if (rank_of(other) < rank_of(registration)) registration = std::move(other);
  }

  /// The better of two results comes first.
  static std::pair<RegistrationQuality, double> rank_of(const Registration<Real>& registration) {
    return {registration.quality, share_of(registration)};
  }

  static double share_of(const Registration<Real>& registration) {
    return registration.far_share + registration.disagreeing;
  }

  /// Bends the template on its coarse mesh from each candidate, draws the best ones into the scan,
  /// and returns the best result.
  Registration<Real> best_of(std::vector<Candidate> tried, const CoarseMesh& mesh,
                             CoarseFit& coarse, FineRounds& rounds, const Measurement& scan) {
    if (tried.size() > 1) {
      for (Candidate& candidate : tried) {
        candidate.score =
            fitted(coarse, candidate, scan, constants_.trial_points, constants_.trial_passes)
                .far_share;
      }
      std::ranges::stable_sort(tried, {}, &Candidate::score);
      tried.resize(std::min(tried.size(), constants_.finished));
    }
    for (Candidate& candidate : tried) {
      const auto result =
          fitted(coarse, candidate, scan, constants_.coarse_points, constants_.passes);
      candidate.x = moved(candidate.motion, mesh.lifted(frame_, result.x, result.rotations));
      const Agreement agreement = agreement_of(candidate.x, scan);
      candidate.score = agreement.far_share + agreement.disagreeing;
    }
    std::ranges::stable_sort(tried, {}, &Candidate::score);
    auto best = finished(tried[0], rounds, scan);
    const Cloud found = stream_.previous;
    for (std::size_t i = 1; i < tried.size(); ++i) {
      const double limit = constants_.close_share * tried[0].score + constants_.close_difference;
      if (tried[i].score > limit || !are_elsewhere(tried[i].x, tried[0].x)) continue;
      auto other = finished(tried[i], rounds, scan);
      const auto [less, more] = std::minmax(tried[0].distance, tried[i].distance);
      const bool both_fit =
          more <= constants_.equal_ratio * less && are_elsewhere(stream_.previous, found) &&
          std::abs(share_of(other) - share_of(best)) < constants_.equal_difference;
      if (share_of(other) < share_of(best)) best = std::move(other);
      best.ambiguous = both_fit;
    }
    if (best.ambiguous && best.quality == RegistrationQuality::good) {
      best.quality = RegistrationQuality::doubtful;
    }
    return best;
  }

  [[nodiscard]] bool are_elsewhere(Field a, Field b) const {
    double distance = 0;
    for (std::size_t v = 0; v < a.size(); ++v) {
      distance += std::sqrt(squared_norm(a[v] - b[v])) / static_cast<double>(a.size());
    }
    return distance > constants_.elsewhere * mean_edge();
  }

  /// Bends the template in its own axes.
  CoarseFit::Fitted fitted(CoarseFit& coarse, const Candidate& candidate, const Measurement& scan,
                           std::size_t n_points, int passes) const {
    const Motion back = candidate.motion.inverse();
    PointScan sample;
    sample_scan(scan, back, n_points, sample);
    auto landmarks = candidate.landmarks;
    for (Landmark& landmark : landmarks) {
      landmark.position = from_eigen(back * to_eigen(landmark.position));
    }
    return coarse.fit(sample, landmarks, passes);
  }

  /// Draws the surface into the scan, and describes the result.
  Registration<Real> finished(const Candidate& candidate, FineRounds& rounds,
                              const Measurement& scan) {
    const auto result = rounds.run(scan, moved(candidate.motion, frame_), candidate.x);
    Registration<Real> registration;
    registration.rounds = result.rounds;
    registration.converged = result.converged;
    Eigen::Map<Eigen::Matrix<double, 4, 4, Eigen::RowMajor>>(registration.transform.data()) =
        candidate.motion.matrix();
    for (const auto& x : to_caller_order(stream_.numbering, stream_.previous)) {
      for (const double c : {x.x, x.y, x.z}) registration.vertices.push_back(saturated<Real>(c));
    }
    const auto observed = stream_.known_of_caller();
    registration.observed.assign(observed.begin(), observed.end());
    if (settings_.uncertainty) {
      for (const double error : stream_.in_caller_order(rounds.standard_errors())) {
        registration.standard_error.push_back(
            std::isinf(error) ? std::numeric_limits<Real>::infinity() : saturated<Real>(error));
      }
    }
    const Coverage coverage = compare(scan, registration);
    registration.empty_share = coverage.empty_share;
    registration.stretched = coverage.stretched;
    set_quality(scan, coverage, registration);
    return registration;
  }

  /// How far a surface is from the scan. What the sensors see of it is unknown.
  [[nodiscard]] Agreement agreement_of(Field x, const Measurement& scan) const {
    Cloud normals(x.size());
    find_vertex_normals(faces_, x, normals);
    return comparison_.compare({x, normals, {}, mean_edge()}, scan, {}).all;
  }

  /// Compares the result with the scan.
  Coverage compare(const Measurement& scan, Registration<Real>& registration) const {
    const Cloud& x = stream_.previous;
    Cloud normals(x.size());
    find_vertex_normals(faces_, x, normals);
    const double edge = mean_edge();
    std::vector<Sight> seen(x.size());
    Visibility(x.size()).find(
        faces_, x, normals, scan.viewpoints(), find_sheets(faces_, stream_.topology->component),
        {tracking_.pixel * edge, tracking_.thickness * edge, tracking_.back_thickness * edge},
        seen);
    for (std::size_t v = 0; v < seen.size(); ++v) {
      if (seen[v] == Sight::back) normals[v] = -1.0 * normals[v];
    }
    const Agreement agreement = comparison_.compare({x, normals, seen, edge}, scan, {}).all;
    registration.far_share = agreement.far_share;
    registration.disagreeing = agreement.disagreeing;
    registration.distance = agreement.distance;
    return coverage_of({faces_, stream_.topology->cells, frame_, x, normals, seen, edge}, scan,
                       tracking_, constants_);
  }

  /// Whether a vertex is not where the caller says. What no sensor measured follows the shape
  /// alone.
  [[nodiscard]] bool have_misplaced_landmarks(const Measurement& scan) const {
    const double limit = constants_.misplaced_landmark * size_of(stream_.previous);
    constexpr double any_normal = -2;
    for (std::size_t i = 0; i < targets_.vertices.size(); ++i) {
      const auto& position = targets_.positions[i];
      const auto& found = stream_.previous[static_cast<std::size_t>(targets_.vertices[i])];
      const bool is_measured =
          scan.viewpoints().empty() ||
          scan.nearest(position, {}, limit, any_normal, Measurement::no_guess).weight > 0;
      if (is_measured && squared_norm(found - position) > limit * limit) return true;
    }
    return false;
  }

  void set_quality(const Measurement& scan, const Coverage& coverage,
                   Registration<Real>& registration) const {
    const bool is_ruined = registration.far_share > constants_.ruined_far ||
                           registration.disagreeing > constants_.ruined_disagreeing ||
                           registration.stretched > constants_.ruined_stretched;
    const bool is_doubtful = registration.far_share > constants_.doubtful_far ||
                             registration.empty_share > constants_.doubtful_empty ||
                             coverage.bridging > constants_.doubtful_bridging ||
                             registration.stretched > constants_.doubtful_stretched ||
                             have_misplaced_landmarks(scan);
    registration.quality = is_ruined     ? RegistrationQuality::ruined
                           : is_doubtful ? RegistrationQuality::doubtful
                                         : RegistrationQuality::good;
  }

  RegistrationConstants constants_;
  RegistrationSettings settings_;
  Cloud given_;  // the template in the caller's order
  Stream<double> stream_;
  std::vector<Triangle> faces_;
  Cloud frame_;  // the template in the internal order
  TrackingConstants tracking_;
  SurfaceComparison comparison_;
  TrainingFrames training_;
  Targets targets_;
};

}  // namespace

template <class Real>
Registration<Real> register_measurement(Faces faces, Points<const Real> positions,
                                        const Measurement& measured,
                                        const RegistrationSettings& settings) {
  return Work<Real>(faces, positions, {}, settings, nullptr).run(measured);
}

template Registration<float> register_measurement(Faces, Points<const float>, const Measurement&,
                                                  const RegistrationSettings&);
template Registration<double> register_measurement(Faces, Points<const double>, const Measurement&,
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
  measured.prepare(TrackingConstants{}.jump * work.mean_edge(), work.workers());
  return work.run(measured);
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
