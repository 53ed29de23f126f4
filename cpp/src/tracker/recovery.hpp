/// What a tracker does when the template is lost: see TrackerSettings::recover.
#pragma once

#include <cstdint>
#include <dynmesh/tracker.hpp>
#include <dynmesh/types.hpp>
#include <optional>
#include <vector>

#include "stream/stream.hpp"
#include "support/stored_numbers.hpp"
#include "tracking/point_scan.hpp"
#include "tracking/surface_tracking.hpp"

namespace dynmesh {

/// Registers lost frames anew from the last good one.
class Recovery {
 public:
  using Frame = std::vector<Vector3<double>>;

  /// Begins a sequence. `mesh` must outlive this object.
  Recovery(StreamMesh& mesh, Frame first_frame, bool is_wanted);

  /// Whether a frame is to be registered anew.
  [[nodiscard]] bool is_due(const Agreement& agreement) const;
  /// Registers it, and tracks it again from there. `found` is what the surface has just found, and
  /// becomes the better of both. Returns whether that is the new one; if not, nothing but time
  /// tells of the attempt. If it throws, the surface remembers the same as before.
  bool improve(SurfaceTracking& surface, const PointScan& measurement,
               SurfaceTracking::Found& found) const;

  /// Remembers a frame, and whether it was registered anew.
  void remember(const Frame& completed, const Agreement& agreement, bool was_due) noexcept;

  /// What later frames depend on.
  void write_memory(Writer& writer) const;
  void read_memory(Reader& reader);

 private:
  [[nodiscard]] std::optional<Frame> registered(const PointScan& measurement) const;

  StreamMesh& mesh_;
  bool is_wanted_;
  Frame good_;  // the last frame that was not lost
  // The number of frames that are not registered. A scan that has been far from the surface from
  // the start may show other things beside it, so the first pause lasts until a frame is good.
  std::uint8_t pause_ = until_good;
  static constexpr std::uint8_t until_good = 255;
};

}  // namespace dynmesh
