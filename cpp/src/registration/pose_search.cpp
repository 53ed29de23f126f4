#include "registration/pose_search.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <utility>

#include "base/geometry.hpp"
#include "base/rigid_motion.hpp"
#include "base/statistics.hpp"
#include "frame/generations.hpp"
#include "mesh/decimation.hpp"
#include "quality/coverage.hpp"
#include "quality/limits.hpp"
#include "quality/measure.hpp"
#include "registration/part_starts.hpp"
#include "registration/pose_quality.hpp"
#include "registration/rigid_starts.hpp"
#include "surface_fit/materials.hpp"

namespace dynmesh {
namespace {

TrackingConstants for_coarse() {
  TrackingConstants coarse;
  coarse.most_iterations = registration_constants.iterations;
  return coarse;
}

double mean_distance(Field x, Field y) {
  double sum = 0;
  for (std::size_t v = 0; v < x.size(); ++v) sum += std::sqrt(squared_norm(x[v] - y[v]));
  return sum / static_cast<double>(x.size());
}

}  // namespace

PoseSearch::PoseSearch(const Template& given, const Topology& topology, Workers& workers,
                       const RegistrationSettings& settings, double epsilon)
    : template_(given),
      topology_(topology),
      settings_(settings),
      workers_(workers),
      is_sheet_(find_sheets(given.faces, topology.component)),
      is_border_(find_border(given.faces, given.frame.size())),
      fine_(given.faces, topology, workers, given.frame, {}, given.training, settings.uncertainty,
            epsilon),
      errors_(fine_.model(), fine_.materials(), fine_.factors(), fine_.constants(), workers,
              settings.uncertainty),
      mesh_(decimated(given.faces, topology, given.frame,
                      {{fine_.constants().coarse_vertices}, fine_.constants().fewest_vertices, {}}),
            fine_.model(), fine_.materials(), workers),
      is_coarse_sheet_(find_sheets(mesh_.faces(), mesh_.topology().component)),
      coarse_(mesh_.faces(), mesh_.topology(), workers, mesh_.first_frame(), for_coarse()),
      fine_first_(given.frame),
      coarse_first_({mesh_.first_frame().begin(), mesh_.first_frame().end()}) {
  fine_.begin(fine_first_);
  fine_first_.errors = errors_.no_errors();
  coarse_.begin(coarse_first_);
}

Pose PoseSearch::run(const PointScan& scan, const Targets& targets) {
  const Wanted given = wanted(scan, targets);
  if (!settings_.align) {
    const auto trials = trials_of({{Eigen::Isometry3d::Identity(), targets}}, given);
    return *finish(given, trials.front(), {}).best;
  }
  Found found = search(given, targets, {});
  // Between landmarks that are few or in unlucky places, the template may bend the wrong way.
  if (!found.is_good() && !targets.vertices.empty()) {
    found = search(given, given.held, {std::move(found.best)});
  }
  return *std::move(found.best);
}

/// Tries where the template may be, near its own pose and then far from it, until a pose is good,
/// and keeps the best one. All others can wait if one hardly leaves anything unexplained, of the
/// coarse mesh or of the points, which hardly show whether a limb is twisted.
PoseSearch::Found PoseSearch::search(const Wanted& wanted, const Targets& targets, Found found) {
  auto candidates = by_points(wanted, targets);
  if (targets.determine_a_rotation()) {
    candidates.push_back({targets.motion_from(template_.frame), targets});
  }
  std::vector<Trial> trials = trials_of(candidates, wanted);
  // A part may be bent into any place of a whole.
  const bool is_part = wanted.ratio > constants_.part;
  if (!is_part) found = finish_best(wanted, trials, false, std::move(found));
  const bool begins_with_parts = is_part || wanted.ratio < 1 / constants_.part;
  for (const bool seeks_parts : {begins_with_parts, !begins_with_parts}) {
    if (found.is_good()) return found;
    candidates = seeks_parts
                     ? by_parts(wanted, targets)
                     : candidates_by_tips(template_.faces, template_.frame, wanted.scan, targets);
    std::ranges::move(trials_of(candidates, wanted), std::back_inserter(trials));
    std::ranges::stable_sort(trials, {}, &Trial::misfit);
    found = finish_best(wanted, trials, false, std::move(found));
  }
  return finish_best(wanted, trials, true, std::move(found));
}

/// Draws the template into the scan from trials, the best first, of which some or all hardly leave
/// anything unexplained, until a pose is good and no other trial is better than it.
PoseSearch::Found PoseSearch::finish_best(const Wanted& wanted, const std::vector<Trial>& trials,
                                          bool are_all, Found found) {
  for (const Trial& trial : trials) {
    if (found.from.size() >= constants_.most_finished) break;
    if (found.is_good() && !(trial.misfit() < found.best->fit.misfit())) break;
    const double unexplained = trial.fit.missing() + trial.fit.evidence.contradicted();
    if (!are_all && unexplained > constants_.complete) break;
    found = finish(wanted, trial, std::move(found));
  }
  return found;
}

/// Draws the template into the scan from a trial that is unlike those before, and keeps the better
/// pose, of equal ones the first.
PoseSearch::Found PoseSearch::finish(const Wanted& wanted, const Trial& trial, Found found) {
  const auto is_like = [&](const Cloud& other) { return are_alike(trial.x, other); };
  if (std::ranges::any_of(found.from, is_like)) return found;
  found.from.push_back(trial.x);
  Pose pose = finished(wanted, trial);
  if (!found.best || pose.misfit() < found.best->misfit()) found.best = std::move(pose);
  return found;
}

double PoseSearch::growth(const PointScan& scan, const Targets& targets) {
  const Wanted given = wanted(scan, targets);
  const Trial trial = trials_of(by_points(given, targets), given).front();
  return change_of(mesh_.topology().cells, mesh_.first_frame(), trial.x).growth;
}

/// Tells the landmarks of parts without points from the others.
PoseSearch::Wanted PoseSearch::wanted(const PointScan& scan, const Targets& targets) const {
  const auto dense =
      std::make_shared<const PointScan>(sample_scan(scan, part_start_constants.points));
  const auto sample =
      std::make_shared<const PointScan>(sample_scan(*dense, rigid_start_constants.points));
  Wanted made{scan, dense, sample, {}, {}};
  double scanned = 0;
  for (std::size_t i = 0; i < dense->size(); ++i) scanned += area_around(*dense, i);
  const double area = area_of(template_.faces, template_.frame);
  if (area > 0) made.ratio = scanned / area;
  std::vector<double> spacings;
  for (std::size_t i = 0; i < scan.size(); i += 1 + scan.size() / 256) {
    spacings.push_back(std::sqrt(scan.squared_spacing(i)));
  }
  const double reach =
      std::max(fine_.mean_edge(), constants_.held_spacings * quantile(std::move(spacings), 0.5));
  for (std::size_t i = 0; i < targets.vertices.size(); ++i) {
    Targets& kind = scan.distance(targets.positions[i]) < reach ? made.checked : made.held;
    kind.add(targets.vertices[i], targets.positions[i]);
  }
  return made;
}

std::vector<Candidate> PoseSearch::by_points(const Wanted& wanted, const Targets& targets) const {
  std::vector<Candidate> found;
  if (wanted.ratio > constants_.part) found.push_back({Eigen::Isometry3d::Identity(), targets});
  for (const auto& motion : rigid_starts(template_.faces, template_.frame, *wanted.sample)) {
    found.push_back({motion, targets});
  }
  return found;
}

/// Where the template may lie on a part of the scan, or the scan on a part of the template.
std::vector<Candidate> PoseSearch::by_parts(const Wanted& wanted, const Targets& targets) const {
  const SurfaceSample places =
      sample_surface(template_.faces, template_.frame, rigid_start_constants.places);
  PointScan surface;
  surface.points = places.points;
  surface.normals = places.normals;
  std::vector<Candidate> found;
  if (wanted.ratio > part_start_constants.least_whole) {
    for (const auto& motion : part_starts(surface, *wanted.dense)) {
      found.push_back({motion, targets});
    }
  }
  if (1 / wanted.ratio > part_start_constants.least_whole) {
    for (const auto& motion : part_starts(*wanted.sample, surface)) {
      found.push_back({motion.inverse(), targets});
    }
  }
  return found;
}

/// A sample of the points that are not farther from a template that was moved than it reaches.
std::shared_ptr<const PointScan> PoseSearch::around(const Eigen::Isometry3d& motion,
                                                    const Wanted& wanted) const {
  Eigen::AlignedBox3d box;
  for (const auto& x : template_.frame) box.extend(to_eigen(x));
  double radius = 0;
  for (const auto& x : template_.frame) {
    radius = std::max(radius, (to_eigen(x) - box.center()).norm());
  }
  const Eigen::Vector3d centre = motion * box.center();
  const auto is_near = [&](const Vector3& x) {
    return (to_eigen(x) - centre).norm() < constants_.around * radius;
  };
  if (std::ranges::all_of(wanted.sample->points, is_near)) return wanted.sample;
  std::vector<std::size_t> numbers;
  for (std::size_t i = 0; i < wanted.dense->size(); ++i) {
    if (is_near(wanted.dense->points[i])) numbers.push_back(i);
  }
  if (numbers.size() < fine_.constants().fewest) return wanted.sample;
  return std::make_shared<const PointScan>(
      sample_scan(part_of(*wanted.dense, numbers), rigid_start_constants.points));
}

/// Whether two poses of the coarse mesh are the same.
bool PoseSearch::are_alike(const Cloud& x, const Cloud& y) const {
  return mean_distance(x, y) < constants_.same_pose * coarse_.mean_edge();
}

/// Bends the coarse mesh from all candidates, and draws it to the scan from those that fit best and
/// are unlike each other; the best of these as long as that helps. The result begins with it.
std::vector<PoseSearch::Trial> PoseSearch::trials_of(const std::vector<Candidate>& candidates,
                                                     const Wanted& wanted) {
  std::vector<Trial> trials;
  for (const Candidate& candidate : candidates) trials.push_back(bent(candidate, wanted));
  std::ranges::stable_sort(trials, {}, &Trial::misfit);
  std::vector<Trial> unlike;
  for (Trial& trial : trials) {
    const auto is_like = [&](const Trial& other) { return are_alike(trial.x, other.x); };
    if (std::ranges::none_of(unlike, is_like)) unlike.push_back(std::move(trial));
    if (unlike.size() == rigid_start_constants.starts) break;
  }
  trials = std::move(unlike);
  for (Trial& trial : trials) trial = drawn(std::move(trial));
  std::ranges::stable_sort(trials, {}, &Trial::misfit);
  if (trials.empty()) return trials;
  Trial& best = trials.front();
  for (Trial again = drawn(best); again.misfit() < best.misfit(); again = drawn(best)) {
    best = std::move(again);
  }
  return trials;
}

/// The coarse mesh, moved and bent until its landmarks are at their positions.
PoseSearch::Trial PoseSearch::bent(const Candidate& candidate, const Wanted& wanted) {
  if (settings_.before_step) settings_.before_step();
  Cloud start;
  for (const auto& x : mesh_.first_frame())
    start.push_back(from_eigen(candidate.motion * to_eigen(x)));
  Memory memory = placed(start);
  auto marks =
      landmarks_on_coarse(candidate.landmarks, candidate.motion, constants_.landmark_weight);
  const auto rough =
      landmarks_on_coarse(candidate.rough, candidate.motion, constants_.rough_weight);
  marks.insert(marks.end(), rough.begin(), rough.end());
  if (!marks.empty()) {
    coarse_.bend({.landmarks = marks, .yields_beyond = constants_.usual_departures},
                 constants_.bending_steps, memory);
  }
  Trial trial{candidate, around(candidate.motion, wanted)};
  const FittedSurface found = coarse_.agreement_with(*trial.sample, std::move(memory.last));
  return compared(std::move(trial), found);
}

/// The coarse mesh of a trial, drawn to the scan.
PoseSearch::Trial PoseSearch::drawn(Trial trial) {
  if (settings_.before_step) settings_.before_step();
  const Memory memory = placed(trial.x);
  const auto& [motion, landmarks, rough] = trial.candidate;
  const auto marks = landmarks_on_coarse(landmarks, motion, constants_.landmark_weight);
  Memory next = memory;
  const FittedSurface found = coarse_.fit(memory, *trial.sample,
                                          {.landmarks = marks,
                                           .fewest_iterations = constants_.iterations,
                                           .yields_beyond = constants_.usual_departures},
                                          next);
  return compared(std::move(trial), found);
}

/// What is remembered of the coarse mesh in a pose.
Memory PoseSearch::placed(const Cloud& x) {
  Memory memory = coarse_first_;
  coarse_.place(x, memory);
  coarse_.forget_shape(memory);
  return memory;
}

/// A trial whose coarse mesh was found among its points.
PoseSearch::Trial PoseSearch::compared(Trial trial, const FittedSurface& found) const {
  trial.fit =
      fit_of({mesh_.faces(), mesh_.topology(), mesh_.first_frame(), found.x, found.normals,
              is_coarse_sheet_, coarse_.mean_edge(), size_of_surface(mesh_.faces(), found.x)},
             found, false);
  trial.x = found.x;
  return trial;
}

/// How a surface lies in a scan. Without sensors, what its own parts hide on all sides is left out
/// if all sides are drawn.
Fit PoseSearch::fit_of(const BentSurface& surface, const FittedSurface& found,
                       bool draws_all_sides) const {
  const PointScan& scan = *found.points.scan;
  const std::vector<std::uint8_t> all(draws_all_sides ? 0 : surface.x.size(), 1);
  // The inside of a face or of clothes is not measured: something else is there.
  const SightSettings settings = {.near = fine_.constants().radius * surface.mean_edge,
                                  .without_sensors = all,
                                  .shows_insides = false};
  const Agreement& agreement = found.agreements.all;
  return {evidence_of(surface, found.points, settings, workers_),
          scan.sensors.empty() ? 0 : constants_.unseen,
          agreement.points > 0 ? agreement.far_share + agreement.disagreeing : 1,
          mean_stretch(surface.topology.cells, surface.first_frame, surface.x)};
}

/// Landmarks on the coarse mesh of a template that was moved.
std::vector<Landmark> PoseSearch::landmarks_on_coarse(const Targets& landmarks,
                                                      const Eigen::Isometry3d& motion,
                                                      double weight) const {
  std::vector<Landmark> marks;
  for (std::size_t i = 0; i < landmarks.vertices.size(); ++i) {
    const Index vertex = landmarks.vertices[i];
    const std::size_t coarse = mesh_.nearest(vertex);
    const auto arm = mesh_.first_frame()[coarse] - template_.frame[at(vertex)];
    const auto turned = from_eigen(motion.linear() * to_eigen(arm));
    marks.push_back({coarse, landmarks.positions[i] + turned, weight});
  }
  return marks;
}

/// Draws the template into the scan from where the coarse mesh is. At first it is stiff and its
/// shape yields nowhere, which untwists its limbs; then the weight of the points grows, and at last
/// the shape yields at its joints, which brings all of it to the points. Rounds are frames of a
/// tracker, whose prediction goes on with what moves slowly, such as limbs that untwist.
Pose PoseSearch::finished(const Wanted& wanted, const Trial& trial) {
  Memory memory = fine_first_;
  Memory next = fine_first_;
  const Cloud start =
      mesh_.restored(coarse_first_, placed(trial.x), fine_first_, fine_first_.m, memory);
  fine_.place(start, memory);
  fine_.forget_shape(memory);
  std::vector<Landmark> landmarks;
  for (std::size_t i = 0; i < wanted.held.vertices.size(); ++i) {
    landmarks.push_back(
        {at(wanted.held.vertices[i]), wanted.held.positions[i], constants_.landmark_weight});
  }
  const TrackingConstants& tracking = fine_.constants();
  Pose pose;
  FittedSurface found;
  double weight = 1;  // of a point, as a multiple of that in tracking
  bool yields = false;
  while (!pose.converged && pose.rounds < constants_.most_rounds) {
    if (settings_.before_step) settings_.before_step();
    FitOptions options = {landmarks, tracking.most_iterations, weight};
    if (yields) {
      options.fewest_iterations = tracking.final_iterations;
      options.yields_beyond = constants_.usual_departures;
    }
    found = fine_.fit(memory, wanted.scan, options, next);
    const bool stays = mean_distance(found.x, memory.last) < constants_.settled * fine_.mean_edge();
    pose.converged = stays && yields;
    ++pose.rounds;
    pose.x = found.x;
    pose.observed = found.observed;
    pose.measure.agreement = found.agreements.all;
    if (settings_.uncertainty) {
      next.generations.classify(topology_.cells, pose.observed);
      const bool is_lost = pose.measure.agreement.far_share > quality_limits.ruined_far;
      errors_.measure(found, is_lost, memory, next);
    }
    std::ranges::copy(pose.x, next.last.begin());
    fine_.remember(memory, true, next);
    fine_.forget_shape(next);
    std::swap(memory, next);
    weight = std::min(constants_.most_weight, std::sqrt(tracking.weight_growth) * weight);
    if (!yields && (stays || 2 * pose.rounds >= constants_.most_rounds)) {
      yields = true;
      weight = constants_.most_weight;
    }
  }
  pose.standard_errors = memory.errors.standard_errors;
  pose.motion = to_eigen(fit_rigid_motion(template_.frame, pose.x));
  judge(wanted, found, pose);
  return pose;
}

void PoseSearch::judge(const Wanted& wanted, const FittedSurface& found, Pose& pose) const {
  const double size = size_of_surface(template_.faces, pose.x);
  const BentSurface surface{template_.faces, topology_, template_.frame,   pose.x,
                            found.normals,   is_sheet_, fine_.mean_edge(), size};
  pose.fit = fit_of(surface, found, true);
  pose.measure = measured(found, pose.fit.evidence, topology_.cells, template_.frame);
  pose.measure.stretch = pose.fit.stretch;
  pose.measure.unexplained =
      unexplained_beside(found.points, is_border_, pose.fit.evidence.points.noise);
  pose.measure.overlap = overlap_of(surface);
  pose.measure.quality = quality_of_pose(pose.fit, pose.measure);
  const double limit = constants_.misplaced_landmark * size;
  for (std::size_t i = 0; i < wanted.checked.vertices.size(); ++i) {
    const auto arm = pose.x[at(wanted.checked.vertices[i])] - wanted.checked.positions[i];
    if (squared_norm(arm) > limit * limit) pose.has_misplaced_landmarks = true;
  }
  if (pose.has_misplaced_landmarks && pose.is_good()) pose.measure.quality = Quality::doubtful;
}

}  // namespace dynmesh
