#include "registration/pose_search.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "registration/surface_sample.hpp"
#include "support/eigen_points.hpp"
#include "tracking/point_scan.hpp"

namespace dynmesh {
namespace {

using Cloud = std::vector<Vector3<double>>;
using Motion = Eigen::Isometry3d;

Cloud moved(const Motion& motion, std::span<const Vector3<double>> frame) {
  Cloud result(frame.size());
  std::ranges::transform(frame, result.begin(),
                         [&](const auto& x) { return from_eigen(motion * to_eigen(x)); });
  return result;
}

Candidate candidate_of(const Pose& pose) { return {.motion = pose.motion, .x = pose.x}; }

/// The better of two poses comes first.
std::pair<bool, double> rank_of(const Pose& pose) { return {pose.is_ruined(), pose.misfit()}; }

/// Where a part is missing, edges that nobody measured may have any length.
bool has_exchanged_limbs(const Pose& pose, const RegistrationConstants& constants) {
  return pose.coverage.has_bridges(constants) &&
         pose.coverage.empty_share <= constants.doubtful_empty;
}

}  // namespace

PoseSearch::PoseSearch(const ScaledTemplate& scaled, const Targets& targets,
                       const RegistrationSettings& settings, double epsilon, Stream<double>& stream,
                       const RegistrationConstants& constants)
    : template_(scaled),
      targets_(targets),
      settings_(settings),
      stream_(stream),
      constants_(constants),
      measure_(scaled.faces, *stream.topology, scaled.frame, targets, stream.workers, constants),
      mesh_(coarse_mesh_of(scaled.faces, scaled.frame, constants.most_coarse_vertices)),
      coarse_(mesh_, stream.workers, constants),
      rounds_(scaled.faces, stream, scaled.training, settings.uncertainty, epsilon, constants,
              constants.fine()) {}

Pose PoseSearch::run(const PointScan& scan) {
  return targets_.vertices.empty() && settings_.align ? without_landmarks(scan)
                                                      : with_landmarks(scan);
}

/// With landmarks, or in place.
Pose PoseSearch::with_landmarks(const PointScan& scan) {
  const auto landmarks = targets_.landmarks_of(template_.frame);
  if (!settings_.align) {
    return best_of(scan, {{Motion::Identity(), landmarks}}, constants_.most_rounds);
  }
  const auto by_points = [&] { return candidates_by_points(shape(), scan, landmarks, constants_); };
  Pose pose;
  if (targets_.determine_a_rotation()) {
    pose =
        best_of(scan, {{targets_.motion_from(template_.frame), landmarks}}, constants_.most_rounds);
    // Landmarks on limbs that have moved say little about the motion of the whole.
    if (!pose.is_good()) try_others(scan, by_points(), pose);
  } else {
    pose = best_of(scan, by_points(), constants_.most_rounds);
  }
  // Between landmarks that are few or in unlucky places, the template may bend the wrong way.
  if (pose.is_ruined() || has_exchanged_limbs(pose, constants_) ||
      measure_.has_misplaced_landmarks(pose, scan)) {
    Pose other = without_landmarks(scan);
    if (!measure_.has_misplaced_landmarks(other, scan) && rank_of(other) < rank_of(pose)) {
      pose = std::move(other);
    }
  }
  return pose;
}

Pose PoseSearch::without_landmarks(const PointScan& scan) {
  Pose pose =
      best_of(scan, candidates_by_points(shape(), scan, {}, constants_), constants_.most_rounds);
  const double far = pose.agreement.far_share;
  // What must be stretched so much is another body.
  const bool is_other =
      far >= constants_.tips.largest_far || pose.coverage.stretched > constants_.ruined_stretched;
  // By one sensor, limbs end where it does not see them.
  const bool has_tips = scan.viewpoints().size() != 1;
  const bool is_wrong = far > constants_.doubtful_far || has_exchanged_limbs(pose, constants_);
  if (is_wrong && !is_other && has_tips) try_tips(scan, pose);
  return pose;
}

TemplateShape PoseSearch::shape() const {
  return {template_.faces, template_.frame, measure_.mean_edge()};
}

/// Brings tips of limbs to those of the scan: those that the result left out, and all of them.
void PoseSearch::try_tips(const PointScan& scan, Pose& best) {
  const TipConstants& c = constants_.tips;
  for (std::size_t i = 0; i < c.points.size() && (i == 0 || !best.is_good()); ++i) {
    const TipsOfBoth tips = tips_of_both(shape(), scan, c.points[i], c);
    repair(scan, tips, best);
    // Also if that is good: a body that is turned front to back may be as well.
    if (try_others(scan, candidates_by_tips(shape(), tips, c), best)) repair(scan, tips, best);
    exchange(scan, tips, best);
    if (c.points[i] >= scan.size()) break;
  }
}

/// Brings one tip of the template to one that the result left out, as long as that helps.
void PoseSearch::repair(const PointScan& scan, const TipsOfBoth& tips, Pose& best) {
  const TipConstants& c = constants_.tips;
  for (int n = 0; n < c.repairs && !best.is_good(); ++n) {
    auto others = candidates_by_tips_left_out(shape(), tips, best.motion, best.x, c);
    if (!try_others(scan, std::move(others), best)) return;
  }
}

/// Lets two tips change places, if that helps.
void PoseSearch::exchange(const PointScan& scan, const TipsOfBoth& tips, Pose& best) {
  try_others(scan, candidates_by_exchanged_tips(shape(), tips, best.motion, best.x), best);
}

/// Replaces the best pose by one from other candidates if that is better, and tells whether.
bool PoseSearch::try_others(const PointScan& scan, std::vector<Candidate> others, Pose& best) {
  if (others.empty()) return false;
  Pose other = best_of(scan, std::move(others), constants_.rounds_of_others);
  const double limit = constants_.close_share * best.misfit() + constants_.close_difference;
  if (other.misfit() > limit) return false;
  const bool is_ambiguous = other.ambiguous;
  other = finished(scan, candidate_of(other), constants_.most_rounds, rounds_);
  const double more = std::max(other.misfit(), best.misfit());
  const double less = std::min(other.misfit(), best.misfit());
  const bool both_fit =
      more <= constants_.equal_ratio * less && measure_.are_elsewhere(other.x, best.x);
  const bool is_better = rank_of(other) < rank_of(best);
  if (is_better) {
    best = std::move(other);
    best.set_ambiguous(is_ambiguous);
  }
  if (both_fit) best.set_ambiguous(true);
  return is_better;
}

/// Draws the surface into the scan from each likely candidate, and returns the best pose.
Pose PoseSearch::best_of(const PointScan& scan, std::vector<Candidate> tried, int most_rounds) {
  tried = likely(scan, std::move(tried));
  Pose best = finished(scan, tried[0], most_rounds, rounds_);
  bool is_ambiguous = false;
  for (std::size_t i = 1; i < tried.size(); ++i) {
    Pose other = finished(scan, tried[i], most_rounds, rounds_);
    const auto [less, more] = std::minmax(tried[0].distance, tried[i].distance);
    const bool both_fit = more <= constants_.equal_ratio * less &&
                          measure_.are_elsewhere(other.x, best.x) &&
                          std::abs(other.misfit() - best.misfit()) < constants_.equal_difference;
    const bool is_better = other.misfit() < best.misfit();
    is_ambiguous = both_fit || (is_ambiguous && !is_better);
    if (is_better) best = std::move(other);
  }
  best.set_ambiguous(is_ambiguous);
  return best;
}

/// Bends the template on its coarse mesh from each candidate. Those with which it may fit come back
/// with its positions, the most likely one first.
std::vector<Candidate> PoseSearch::likely(const PointScan& scan, std::vector<Candidate> tried) {
  if (tried.size() > 1) {
    for (Candidate& candidate : tried) {
      candidate.score =
          fitted(candidate, scan, constants_.trial_points, constants_.trial_passes).misfit;
    }
    std::ranges::stable_sort(tried, {}, &Candidate::score);
    tried.resize(std::min(tried.size(), constants_.finished));
  }
  for (Candidate& candidate : tried) {
    const auto result = fitted(candidate, scan, constants_.coarse_points, constants_.passes);
    candidate.x =
        moved(candidate.motion, mesh_.lifted(template_.frame, result.x, result.rotations));
    candidate.score = measure_.misfit_of(candidate.x, scan);
  }
  std::ranges::stable_sort(tried, {}, &Candidate::score);
  const double limit = constants_.close_share * tried[0].score + constants_.close_difference;
  const auto is_unlikely = [&](const Candidate& candidate) {
    return candidate.score > limit || !measure_.are_elsewhere(candidate.x, tried[0].x);
  };
  tried.erase(std::remove_if(tried.begin() + 1, tried.end(), is_unlikely), tried.end());
  return tried;
}

/// Bends the template in its own axes.
CoarseFit::Fitted PoseSearch::fitted(const Candidate& candidate, const PointScan& scan,
                                     std::size_t n_points, int passes) {
  const Motion back = candidate.motion.inverse();
  PointScan sample;
  sample_scan(scan, back, n_points, sample);
  auto landmarks = candidate.landmarks;
  for (TemplateLandmark& landmark : landmarks) {
    landmark.position = from_eigen(back * to_eigen(landmark.position));
  }
  return coarse_.fit(sample, landmarks, passes);
}

/// Draws the surface into the scan, and measures the result.
Pose PoseSearch::finished(const PointScan& scan, const Candidate& candidate, int most_rounds,
                          FineRounds& rounds) {
  const auto result =
      rounds.run(scan, moved(candidate.motion, template_.frame), candidate.x, most_rounds);
  Pose pose;
  pose.motion = candidate.motion;
  pose.x.assign(stream_.previous.begin(), stream_.previous.end());
  const auto observed = stream_.known_of_caller();
  pose.observed.assign(observed.begin(), observed.end());
  if (settings_.uncertainty) {
    const auto errors = stream_.in_caller_order(rounds.standard_errors());
    pose.standard_errors.assign(errors.begin(), errors.end());
  }
  pose.rounds = result.rounds;
  pose.converged = result.converged;
  measure_.measure(scan, pose);
  return pose;
}

}  // namespace dynmesh
