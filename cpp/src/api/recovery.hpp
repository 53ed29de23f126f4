/// What a tracker does when the template is lost.
#pragma once

#include <algorithm>
#include <cstdint>
#include <dynmesh/quality.hpp>
#include <dynmesh/registration.hpp>
#include <dynmesh/tracker.hpp>
#include <dynmesh/types.hpp>
#include <limits>
#include <optional>
#include <utility>
#include <vector>

#include "api/stream.hpp"
#include "base/geometry.hpp"
#include "base/statistics.hpp"
#include "base/stored_numbers.hpp"
#include "quality/measure.hpp"
#include "registration/constants.hpp"
#include "registration/pose_search.hpp"
#include "registration/rigid_starts.hpp"
#include "surface_fit/point_scan.hpp"
#include "surface_fit/surface_tracking.hpp"

namespace dynmesh {

/// Seeks the template in the frames in which it is lost, from the last good frame and, at most once
/// in ten frames, by a registration; see TrackerSettings::recover.
class Recovery {
 public:
  using Frame = std::vector<Vector3<double>>;

  /// Begins a sequence. `mesh` must outlive this object.
  Recovery(StreamMesh& mesh, Frame first_frame, bool is_wanted)
      : mesh_(mesh), is_wanted_(is_wanted), first_(std::move(first_frame)), good_(first_) {}

  /// How the surface lies in the scan in which it was found.
  [[nodiscard]] Measure measure(const SurfaceTracking::Found& found) const {
    const Cells& cells = mesh_.topology.cells;
    Measure made = measured(found.agreements.all, found.observed, cells, first_, found.x);
    made.is_start = is_start_ != 0;
    made.quality = judged(made);
    return made;
  }
  /// Whether no frame was good yet.
  [[nodiscard]] bool is_start() const { return is_start_ != 0; }
  /// Whether the template was lost in a frame. A scan that has been far from the surface from the
  /// start may show other things beside it.
  [[nodiscard]] bool is_due(const Measure& measure) const {
    return is_wanted_ && pause_ != until_good && is_lost(measure);
  }

  /// Seeks the template again. `found` is what the surface has just found, with its measure, and
  /// becomes what it finds now. If that is lost, or this throws, the surface remembers the same as
  /// before. Returns whether the template was found again.
  bool find_again(SurfaceTracking& surface, const PointScan& measurement,
                  SurfaceTracking::Found& found, Measure& measure) const {
    Writer writer;
    surface.write_memory(writer);
    const auto memory = writer.take_sealed();
    const Frame last(surface.last().begin(), surface.last().end());
    const auto is_found_from = [&](const Frame& start) {
      surface.place(start);
      found = surface.track(measurement);
      measure = this->measure(found);
      return !is_lost(measure);
    };
    const auto return_to_last = [&] {
      Reader reader(memory);
      surface.read_memory(reader, last);
    };
    try {
      if (is_found_from(good_)) return true;
      if (pause_ == 0) {
        const auto start = registered(measurement);
        if (start && is_found_from(*start)) {
          measure.is_start = false;  // the scan may show another pose
          measure.quality = judged(measure);
          return true;
        }
      }
    } catch (...) {
      return_to_last();
      throw;
    }
    return_to_last();
    found = surface.track(measurement);
    measure = this->measure(found);
    return false;
  }

  /// Remembers a frame, and whether it was sought again: a single one may be of something else.
  void remember(const Frame& completed, const Measure& measure, bool was_due) noexcept {
    const bool has_points = measure.agreement.points > 0;
    if (has_points && (measure.quality == Quality::good || !measure.is_start)) is_start_ = 0;
    if (!is_wanted_) return;
    const bool is_good = has_points && !is_lost(measure);
    if (is_good && !was_due) std::ranges::copy(completed, good_.begin());
    if (pause_ == until_good) {
      if (is_good) pause_ = 0;
    } else if (pause_ > 0) {
      --pause_;
    } else if (was_due) {
      pause_ = static_cast<std::uint8_t>(TrackingConstants().frames_between_recoveries - 1);
    }
  }

  /// What later frames depend on.
  void write_memory(Writer& writer) const {
    writer.write(is_start_);
    if (!is_wanted_) return;
    writer.write(good_);
    writer.write(pause_);
  }
  void read_memory(Reader& reader) {
    is_start_ = reader.read<std::uint8_t>();
    if (is_start_ > 1) refuse_state("does not tell whether a frame was good");
    if (!is_wanted_) return;
    reader.read(good_);
    pause_ = reader.read<std::uint8_t>();
    if (!are_in_range(good_) ||
        (pause_ != until_good && pause_ >= TrackingConstants().frames_between_recoveries)) {
      refuse_state("does not contain a valid last good frame");
    }
  }

 private:
  static bool is_lost(const Measure& measure) { return measure.quality == Quality::ruined; }
  /// The last good shape where it was measured; none if there are too few points, or those of
  /// something of another size.
  [[nodiscard]] std::optional<Frame> registered(const PointScan& measurement) const {
    if (measurement.size() < TrackingConstants{}.fewest) return std::nullopt;
    const double ratio = size_of(measurement.points) / size_of_surface(mesh_.faces, good_);
    if (!(std::max(ratio, 1 / ratio) <= registration_constants.other_unit)) return std::nullopt;
    const Template good = {mesh_.faces, good_, {}};
    const RegistrationSettings settings;
    PoseSearch search(good, mesh_.topology, mesh_.workers, settings,
                      std::numeric_limits<double>::epsilon());
    return search.run(measurement, {}).x;
  }

  StreamMesh& mesh_;
  bool is_wanted_;
  Frame first_;
  Frame good_;  // the last frame that was not lost
  // The number of frames that are not registered. A scan that has been far from the surface from
  // the start may show other things beside it, so the first pause lasts until a frame is good.
  std::uint8_t pause_ = until_good;
  static constexpr std::uint8_t until_good = 255;
  std::uint8_t is_start_ = 1;  // no frame was good yet
};

}  // namespace dynmesh
