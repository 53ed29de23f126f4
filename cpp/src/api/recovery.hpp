/// What a tracker does when the template is lost.
#pragma once

#include <algorithm>
#include <dynmesh/quality.hpp>
#include <dynmesh/registration.hpp>
#include <dynmesh/tracker.hpp>
#include <dynmesh/types.hpp>
#include <limits>
#include <optional>
#include <vector>

#include "api/stream.hpp"
#include "base/geometry.hpp"
#include "base/statistics.hpp"
#include "base/stored_numbers.hpp"
#include "quality/evidence.hpp"
#include "quality/limits.hpp"
#include "quality/measure.hpp"
#include "registration/constants.hpp"
#include "registration/pose_search.hpp"
#include "registration/rigid_starts.hpp"
#include "shape/memory.hpp"
#include "surface_fit/point_scan.hpp"
#include "surface_fit/surface_fit.hpp"

namespace dynmesh {

/// Seeks the template in the frames in which it is lost, from the last good frame and, at most once
/// in ten frames, by a registration; see TrackerSettings::recover.
class Recovery {
 public:
  using Frame = std::vector<Vector3>;

  /// `mesh` and `first_frame` must outlive this object.
  Recovery(Stream& mesh, const SurfaceLevel& surface, const Frame& first_frame, bool is_wanted)
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

  /// What is remembered of frame 0.
  void begin(Memory& memory) const {
    memory.tracking.good = first_;
    memory.tracking.good_in_a_row = quality_limits.settled_frames;
    if (!is_wanted_) return;
    // A scan that has been far from the surface from the start may show other things beside it, so
    // the first pause lasts until a frame is good.
    memory.tracking.frames_until_search = std::nullopt;
  }

  /// How the surface lies in the scan in which it was found, perhaps from a good registration.
  [[nodiscard]] Measure measure(const Memory& memory, const FittedSurface& found,
                                bool was_registered = false) const {
    const Cells& cells = mesh_.topology.cells;
    const PointScan& scan = *found.points.scan;
    Measure made =
        measured_beside_growth(found.agreements.all, found.observed, cells, first_, found.x);
    const auto normals = surface_.normals_of(found.x);
    const double reach = surface_.constants().radius * surface_.mean_edge();
    const Evidence evidence =
        evidence_of(bent(found.x, normals), found.points, {reach, seen_}, mesh_.workers);
    add_evidence(evidence, made);
    const Field before = last_unlost(memory);
    made.change = change_of(cells, before, found.x).stretch;
    made.parted = parted_share(surface_.ties(), before, found.x, surface_.mean_edge());
    made.is_start = memory.tracking.is_start != 0;
    if (!found.lost.empty() && found.agreements.all.points > 0) {
      made.lost = static_cast<double>(found.lost.front());
    }
    made.quality =
        judged(made, {memory.tracking.recent, !scan.sensors.empty(),
                      made.noise / surface_.mean_edge(), was_registered, was_misplaced(memory)});
    return made;
  }
  /// Whether to seek the template elsewhere: it was lost in a frame, after a good one, or much
  /// suddenly speaks against it, as if some of its parts were.
  [[nodiscard]] bool is_due(const Memory& memory, const Measure& measure) const {
    const TrackingMemory& tracking = memory.tracking;
    if (!is_wanted_ || !tracking.frames_until_search) return false;
    const bool is_doubtful = tracking.good_in_a_row == quality_limits.settled_frames &&
                             tracking.frames_until_search == 0 && !measure.is_start &&
                             measure.doubt > quality_limits.sought_doubt;
    return is_lost(measure) || is_doubtful;
  }

  /// What was sought elsewhere.
  struct Sought {
    Memory start, next;  ///< from which the surface was found, and what `fit` wrote
    FittedSurface found = {};
    Measure measure = {};
    bool is_better = false;  ///< than what was found before
    bool by_registration = false;
  };
  /// Seeks the template from elsewhere than in `memory`, from which `found` was found. The search
  /// goes on until a result is good; else, the one with the least doubt replaces a lost one.
  Sought seek(SurfaceFit& surface, const Memory& memory, const PointScan& measurement,
              const FittedSurface& found, const Measure& measure, const Memory& next) const {
    Sought best = {memory, next};
    best.measure = measure;
    const auto fit_from = [&](const Frame& frame, bool was_registered) {
      Sought sought = {memory, next};
      surface.whole().place(frame, sought.start);
      sought.found = surface.fit(sought.start, measurement, sought.next);
      sought.measure = this->measure(memory, sought.found, was_registered);
      const bool is_good = sought.measure.quality == Quality::good;
      const bool has_less_doubt =
          !is_lost(sought.measure) && is_lost(measure) && sought.measure.doubt < best.measure.doubt;
      sought.is_better = is_good || has_less_doubt;
      if (sought.is_better) best = std::move(sought);
    };
    if (is_lost(measure)) fit_from(memory.tracking.good, false);
    const bool is_found = best.is_better && best.measure.quality == Quality::good;
    if (is_found || memory.tracking.frames_until_search != 0 || !are_of_a_surface(found)) {
      return best;
    }
    if (const auto pose = registered(memory.tracking.good, measurement)) {
      fit_from(pose->x, pose->is_good());
    }
    best.measure.is_start = false;  // the scan may show another pose
    best.by_registration = true;
    return best;
  }

  /// Remembers the completed frame, and whether and how it was sought elsewhere. A state that was
  /// found there is the good one after some frames: a single one may be of something else.
  void remember(const Memory& memory, const Measure& measure, const std::optional<Sought>& sought,
                Memory& next) const {
    const bool has_points = measure.agreement.points > 0;
    const bool has_begun = has_points && (measure.quality == Quality::good || !measure.is_start);
    next.tracking.is_start = has_begun ? 0 : memory.tracking.is_start;
    // From a wrong pose, it is found again in a good frame only: a less wrong one is doubtful.
    const bool was_so = was_misplaced(memory) || (sought && sought->is_better);
    const bool is_lost_yet = was_so && measure.quality != Quality::good;
    const bool is_good = has_points && !is_lost(measure) && !is_lost_yet;
    TrackingMemory& tracking = next.tracking;
    tracking.good = memory.tracking.good;
    tracking.recent = memory.tracking.recent;
    tracking.good_in_a_row = memory.tracking.good_in_a_row;
    if (is_good) {
      const int before = sought ? 0 : tracking.good_in_a_row;
      tracking.good_in_a_row = std::min(before + 1, quality_limits.settled_frames);
      // A template that does not fit from the start on says nothing of the subject.
      const bool tells = measure.quality == Quality::good || !measure.is_start;
      if (tells && tracking.good_in_a_row == quality_limits.settled_frames) {
        tracking.good = next.last;
        add_frame(measure, tracking.recent);
      }
    } else if (has_points) {
      tracking.good_in_a_row = 0;
    }
    if (!is_wanted_) return;
    next.tracking.frames_until_search = memory.tracking.frames_until_search;
    if (!memory.tracking.frames_until_search) {
      if (is_good) next.tracking.frames_until_search = 0;
    } else if (*memory.tracking.frames_until_search > 0) {
      next.tracking.frames_until_search = *memory.tracking.frames_until_search - 1;
    } else if (sought && sought->by_registration) {
      next.tracking.frames_until_search = TrackingConstants().frames_between_recoveries - 1;
    }
  }

  /// Refuses what no frames can have left.
  static void check(const Memory& memory) {
    const int frames = memory.tracking.frames_until_search.value_or(0);
    if (frames < TrackingConstants().frames_between_recoveries) return;
    refuse_state("seeks the template later than any frame can");
  }

 private:
  [[nodiscard]] BentSurface bent(Field x, Field normals) const {
    return {mesh_.faces, mesh_.topology,       first_, x, normals,
            is_sheet_,   surface_.mean_edge(), size_};
  }
  static bool was_lost(const Memory& memory) { return memory.tracking.good_in_a_row == 0; }
  /// Whether it was lost while points lay on it. Without any, it was out of sight, and what comes
  /// back near it is the subject, in another shape.
  static bool was_misplaced(const Memory& memory) {
    const auto n_known = static_cast<double>(std::ranges::count(memory.known, 1));
    const auto k = static_cast<double>(memory.known.size());
    return was_lost(memory) && !(n_known < quality_limits.hardly_seen * k);
  }
  /// The last frame that was not lost: with each frame from the good one on, a shape may change.
  static Field last_unlost(const Memory& memory) {
    return was_lost(memory) ? memory.tracking.good : memory.last;
  }
  /// Whether the points lie on some surface, within noise or with normals like those of their
  /// neighbours. Others are of nothing that can be found.
  [[nodiscard]] bool are_of_a_surface(const FittedSurface& found) const {
    const auto normals = surface_.normals_of(found.x);
    const PointQuality points = quality_of(bent(found.x, normals), found.points);
    const double most =
        points.has_normals ? quality_limits.most_noise : quality_limits.most_noise_without_normals;
    return points.noise < most * surface_.mean_edge();
  }
  static bool is_lost(const Measure& measure) { return measure.quality == Quality::ruined; }
  /// The last good shape where it was measured; none if there are too few points, or those of
  /// something of another size.
  [[nodiscard]] std::optional<Pose> registered(const Frame& shape,
                                               const PointScan& measurement) const {
    if (measurement.size() < TrackingConstants{}.fewest) return std::nullopt;
    const double ratio = size_of(measurement.points) / size_of_surface(mesh_.faces, shape);
    if (!(std::max(ratio, 1 / ratio) <= registration_constants.other_unit)) return std::nullopt;
    const Template good = {mesh_.faces, shape, {}};
    const RegistrationSettings settings;
    PoseSearch search(good, mesh_.topology, mesh_.workers, settings,
                      std::numeric_limits<double>::epsilon());
    return search.run(measurement, {});
  }

  Stream& mesh_;
  const SurfaceLevel& surface_;
  std::vector<std::uint8_t> is_sheet_;  // (k,)
  std::vector<std::uint8_t> seen_;      // (k,) of frame 0, from all sides
  bool is_wanted_;
  const Frame& first_;
  double size_;  // of frame 0
};

}  // namespace dynmesh
