#include "api/recovery.hpp"

#include <algorithm>
#include <cmath>
#include <dynmesh/registration.hpp>
#include <dynmesh/tracker.hpp>
#include <limits>
#include <numeric>
#include <utility>

#include "base/geometry.hpp"
#include "base/rigid_motion.hpp"
#include "base/statistics.hpp"
#include "base/stored_numbers.hpp"
#include "quality/evidence.hpp"
#include "quality/limits.hpp"
#include "quality/measure.hpp"
#include "registration/constants.hpp"
#include "registration/rigid_starts.hpp"

namespace dynmesh {
namespace {

bool is_good(const Measure& measure) { return measure.quality == Quality::good; }
bool is_ruined(const Measure& measure) { return measure.quality == Quality::ruined; }

/// How the template was left by the last frame.
enum class Hold {
  held,
  out_of_sight,  ///< lost without points on it: what comes back is the subject, in another shape
  misplaced,     ///< lost while points lay on it: in a wrong pose, in which it may seem less wrong
};

Hold hold_of(const Memory& memory) {
  if (memory.tracking.good_in_a_row > 0) return Hold::held;
  const auto n_known = static_cast<double>(std::ranges::count(memory.known, 1));
  const auto k = static_cast<double>(memory.known.size());
  return n_known < quality_limits.hardly_seen * k ? Hold::out_of_sight : Hold::misplaced;
}

/// The last frame that was held: with each frame from the good one on, a shape may change.
Field last_held(const Memory& memory) {
  return hold_of(memory) == Hold::held ? memory.last : memory.tracking.good;
}

}  // namespace

Recovery::Recovery(Stream& mesh, const SurfaceLevel& surface, const Frame& first_frame,
                   bool is_wanted)
    : mesh_(mesh),
      surface_(surface),
      is_wanted_(is_wanted),
      first_(first_frame),
      size_(size_of(first_frame)) {
  for (const Index of : mesh.topology.component) {
    is_sheet_.push_back(surface.materials()[at(of)].is_sheet ? 1 : 0);
  }
  const auto normals = surface.normals_of(first_frame);
  const std::vector<std::uint8_t> is_measured(first_frame.size());
  seen_ = sight_of(bent(first_frame, normals), {}, is_measured, 0, {}, mesh.workers).seen;
}

BentSurface Recovery::bent(Field x, Field normals) const {
  return {mesh_.faces, mesh_.topology, first_, x, normals, is_sheet_, surface_.mean_edge(), size_};
}

void Recovery::begin(Memory& memory) const {
  memory.tracking.good = first_;
  memory.tracking.good_in_a_row = quality_limits.settled_frames;
  memory.tracking.noise = surface_.constants().usual_noise;
  if (!is_wanted_) return;
  // A scan that has been far from the surface from the start may show other things beside it, so
  // the first pause lasts until a frame is good.
  memory.tracking.frames_until_search = std::nullopt;
}

Measure Recovery::measure(const Memory& memory, const FittedSurface& found,
                          const From& from) const {
  const Cells& cells = mesh_.topology.cells;
  const PointScan& scan = *found.points.scan;
  const double reach = surface_.constants().radius * surface_.mean_edge();
  const Evidence evidence =
      evidence_of(bent(found.x, found.normals), found.points, {reach, seen_}, mesh_.workers);
  Measure made = measured(found, evidence, cells, first_);
  const Field before = last_held(memory);
  made.change = change_of(cells, before, found.x).stretch;
  made.parted = parted_share(surface_.ties(), before, found.x, surface_.mean_edge());
  made.is_start = memory.tracking.is_start != 0;
  if (!found.lost.empty() && found.agreements.all.points > 0) {
    made.lost = static_cast<double>(found.lost.front());
  }
  const Hold hold = hold_of(memory);
  const bool was_misplaced = hold == Hold::misplaced || (hold == Hold::held && from.lost);
  // A body that was turned, and is bent instead, may be bent at its joints, but its last shape lies
  // nearer to the points if it is turned as well.
  const auto times_likely = [&](double leap) {
    const double elsewhere = bent_elsewhere(cells, first_, before, found.x);
    const double bent = std::min(1.0, elsewhere / quality_limits.bent_elsewhere);
    if (scan.size() < surface_.constants().fewest || (leap > 1 && bent == 1)) return 1.0;
    const RigidMotion motion = fit_rigid_motion(before, found.x);
    Frame moved;
    for (const Vector3& x : before) moved.push_back(motion.apply(x));
    PointScan sample = sample_scan(scan, rigid_start_constants.points);
    // Both sides of sheets may be measured, so that the signs of normals say nothing.
    const bool are_sheets = std::ranges::find(is_sheet_, 0) == is_sheet_.end();
    if (are_sheets) sample.undecided.assign(sample.size(), 1);
    return std::max(bent, gain_of_turning(mesh_.faces, moved, sample));
  };
  made.quality = judged(made, {memory.tracking.recent, !scan.sensors.empty(), from.registration,
                               was_misplaced, times_likely});
  return made;
}

bool Recovery::is_due(const Memory& memory, const Measure& measure) const {
  const TrackingMemory& tracking = memory.tracking;
  if (!is_wanted_ || !tracking.frames_until_search) return false;
  const bool is_doubtful = tracking.good_in_a_row == quality_limits.settled_frames &&
                           tracking.frames_until_search == 0 && !measure.is_start &&
                           measure.doubt > quality_limits.sought_doubt;
  return is_ruined(measure) || is_doubtful;
}

/// Whether the points lie on some surface, within noise or with normals like those of their
/// neighbours. Others are of nothing that can be found, and take many iterations.
bool Recovery::are_of_a_surface(const FittedSurface& found) const {
  const PointQuality points = quality_of(bent(found.x, found.normals), found.points);
  const double most =
      points.has_normals ? quality_limits.most_noise : quality_limits.most_noise_without_normals;
  return points.noise < most * surface_.mean_edge();
}

/// The last good shape where it was measured; none if there are too few points, or those of
/// something of another size.
std::optional<Pose> Recovery::registered(const Frame& shape, const PointScan& measurement) const {
  if (measurement.size() < TrackingConstants{}.fewest) return std::nullopt;
  const double ratio = size_of(measurement.points) / size_of_surface(mesh_.faces, shape);
  if (!(std::max(ratio, 1 / ratio) <= registration_constants.other_unit)) return std::nullopt;
  const Template good = {mesh_.faces, shape, {}};
  const RegistrationSettings settings;
  PoseSearch search(good, mesh_.topology, mesh_.workers, settings,
                    std::numeric_limits<double>::epsilon());
  return search.run(measurement, {});
}

Recovery::Sought Recovery::seek(SurfaceFit& surface, const Memory& memory,
                                const PointScan& measurement, const FittedSurface& found,
                                const Measure& measure, const Memory& next) const {
  Sought best = {memory, next};
  best.measure = measure;
  if (!are_of_a_surface(found)) return best;
  const auto seek_from = [&](const Frame& frame, bool was_registered) {
    Sought sought = {memory, next};
    surface.whole().place(frame, sought.start);
    // Limbs may be farther than most of the surface, which tells how many iterations it takes.
    sought.found =
        surface.fit(sought.start, measurement, sought.next, surface_.constants().most_iterations);
    sought.measure = this->measure(memory, sought.found, {was_registered, is_ruined(measure)});
    const bool has_less_doubt = !is_ruined(sought.measure) && is_ruined(measure) &&
                                sought.measure.doubt < best.measure.doubt;
    sought.is_better = is_good(sought.measure) || has_less_doubt;
    if (sought.is_better) best = std::move(sought);
  };
  // From the last good frame.
  if (is_ruined(measure)) seek_from(memory.tracking.good, false);
  if (best.is_better && is_good(best.measure)) return best;
  // By a registration.
  if (memory.tracking.frames_until_search != 0) return best;
  const auto pose = registered(memory.tracking.good, measurement);
  if (pose) seek_from(pose->x, pose->is_good());
  best.measure.is_start = false;  // the scan may show another pose
  best.by_registration = pose.has_value();
  return best;
}

void Recovery::remember(const Memory& memory, const Measure& measure,
                        const std::optional<Sought>& sought, Memory& next) const {
  const bool has_points = measure.agreement.points > 0;
  const bool has_begun = has_points && (is_good(measure) || !measure.is_start);
  next.tracking.is_start = has_begun ? 0 : memory.tracking.is_start;
  // From a wrong pose, it is found again in a good frame only: a less wrong one is doubtful.
  const bool must_be_good = hold_of(memory) == Hold::misplaced || (sought && sought->is_better);
  const bool is_held = has_points && (must_be_good ? is_good(measure) : !is_ruined(measure));
  TrackingMemory& tracking = next.tracking;
  tracking.good = memory.tracking.good;
  tracking.recent = memory.tracking.recent;
  tracking.good_in_a_row = memory.tracking.good_in_a_row;
  if (is_held) {
    const int before = sought ? 0 : tracking.good_in_a_row;
    tracking.good_in_a_row = std::min(before + 1, quality_limits.settled_frames);
    // A template that does not fit from the start on says nothing of the subject.
    const bool tells = is_good(measure) || !measure.is_start;
    if (tells && tracking.good_in_a_row == quality_limits.settled_frames) {
      tracking.good = next.last;
      add_frame(measure, tracking.recent);
    }
  } else if (has_points) {
    tracking.good_in_a_row = 0;
  }
  // Where the template may be wrong, as it may be at first, points weigh as usual, so that it can
  // still turn.
  constexpr int settled = quality_limits.settled_frames;
  const bool is_settled = tracking.good_in_a_row == settled && tracking.recent.count >= settled;
  const double usual = surface_.constants().usual_noise;
  tracking.noise = is_settled ? memory.tracking.noise : usual;
  if (is_settled && measure.noise > 0) {
    const double found = measure.noise / surface_.mean_edge();
    tracking.noise = std::sqrt(std::midpoint(std::pow(tracking.noise, 2), std::pow(found, 2)));
  }
  if (!is_wanted_) return;
  next.tracking.frames_until_search = memory.tracking.frames_until_search;
  if (!memory.tracking.frames_until_search) {
    if (is_held) next.tracking.frames_until_search = 0;
  } else if (*memory.tracking.frames_until_search > 0) {
    next.tracking.frames_until_search = *memory.tracking.frames_until_search - 1;
  } else if (sought && sought->by_registration) {
    next.tracking.frames_until_search = TrackingConstants().frames_between_recoveries - 1;
  }
}

void Recovery::check(const Memory& memory) {
  const int frames = memory.tracking.frames_until_search.value_or(0);
  if (frames < TrackingConstants().frames_between_recoveries) return;
  refuse_state("seeks the template later than any frame can");
}

}  // namespace dynmesh
