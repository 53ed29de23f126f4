/// What a tracker does when the template is lost.
#pragma once

#include <algorithm>
#include <cstdint>
#include <dynmesh/registration.hpp>
#include <dynmesh/tracker.hpp>
#include <dynmesh/types.hpp>
#include <limits>
#include <optional>
#include <utility>
#include <vector>

#include "registration/constants.hpp"
#include "registration/pose_search.hpp"
#include "registration/rigid_starts.hpp"
#include "stream/stream.hpp"
#include "support/geometry.hpp"
#include "support/stored_numbers.hpp"
#include "tracking/point_scan.hpp"
#include "tracking/surface_tracking.hpp"

namespace dynmesh {

/// Registers lost frames anew from the last good one; see TrackerSettings::recover.
class Recovery {
 public:
  using Frame = std::vector<Vector3<double>>;

  /// Begins a sequence. `mesh` must outlive this object.
  Recovery(StreamMesh& mesh, Frame first_frame, bool is_wanted)
      : mesh_(mesh), is_wanted_(is_wanted), good_(std::move(first_frame)) {}

  /// Whether a frame is to be registered anew. The share of one without points is NaN.
  [[nodiscard]] bool is_due(const Agreement& agreement) const {
    return is_wanted_ && pause_ == 0 && agreement.far_share > TrackingConstants().lost_far;
  }

  /// Registers it, and tracks it again from there. `found` is what the surface has just found, and
  /// becomes the better of both. If it is the old one, or this throws, the surface remembers the
  /// same as before.
  void improve(SurfaceTracking& surface, const PointScan& measurement,
               SurfaceTracking::Found& found) const {
    const double lost = wrong_share(found.agreements.all);
    if (const auto start = registered(measurement)) {
      Writer writer;
      surface.write_memory(writer);
      const auto memory = writer.take_sealed();
      const std::vector<Vector3<double>> last(surface.last().begin(), surface.last().end());
      const auto return_to_last = [&] {
        Reader reader(memory);
        surface.read_memory(reader, last);
      };
      surface.place(*start);
      try {
        found = surface.track(measurement);
      } catch (...) {
        return_to_last();
        throw;
      }
      if (wrong_share(found.agreements.all) < lost) return;
      return_to_last();
    }
    found = surface.track(measurement);
  }

  /// Remembers a frame, and whether it was registered anew.
  void remember(const Frame& completed, const Agreement& agreement, bool was_due) noexcept {
    if (!is_wanted_) return;
    constexpr TrackingConstants constants;
    const bool is_good = agreement.far_share <= constants.lost_far;
    if (is_good) std::ranges::copy(completed, good_.begin());
    if (was_due) {
      pause_ = static_cast<std::uint8_t>(constants.frames_between_recoveries - 1);
    } else if (pause_ == until_good) {
      if (is_good) pause_ = 0;
    } else if (pause_ > 0) {
      --pause_;
    }
  }

  /// What later frames depend on.
  void write_memory(Writer& writer) const {
    if (!is_wanted_) return;
    writer.write(good_);
    writer.write(pause_);
  }
  void read_memory(Reader& reader) {
    if (!is_wanted_) return;
    reader.read(good_);
    pause_ = reader.read<std::uint8_t>();
    if (!std::ranges::all_of(good_, is_in_range<double>) ||
        (pause_ != until_good && pause_ >= TrackingConstants().frames_between_recoveries)) {
      refuse_state("does not contain a valid last good frame");
    }
  }

 private:
  static double wrong_share(const Agreement& agreement) {
    return agreement.far_share + agreement.disagreeing;
  }
  /// The last good shape where it was measured; none if there are too few points, or those of
  /// something of another size.
  [[nodiscard]] std::optional<Frame> registered(const PointScan& measurement) const {
    if (measurement.size() < TrackingConstants{}.fewest) return std::nullopt;
    const double ratio = size_of(measurement.points) / size_of(mesh_.faces, good_);
    if (!(std::max(ratio, 1 / ratio) <= registration_constants.other_unit)) return std::nullopt;
    const Template good = {mesh_.faces, good_, {}};
    const RegistrationSettings settings;
    PoseSearch search(good, mesh_.topology, mesh_.workers, settings,
                      std::numeric_limits<double>::epsilon());
    return search.run(measurement, {}).x;
  }

  StreamMesh& mesh_;
  bool is_wanted_;
  Frame good_;  // the last frame that was not lost
  // The number of frames that are not registered. A scan that has been far from the surface from
  // the start may show other things beside it, so the first pause lasts until a frame is good.
  std::uint8_t pause_ = until_good;
  static constexpr std::uint8_t until_good = 255;
};

}  // namespace dynmesh
