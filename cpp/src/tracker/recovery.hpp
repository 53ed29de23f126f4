/// Finds a template again that a tracker has lost.
#pragma once

#include <cstddef>
#include <cstdint>
#include <dynmesh/tracker.hpp>
#include <dynmesh/types.hpp>
#include <optional>
#include <vector>

#include "mesh/numbering.hpp"
#include "support/stored_numbers.hpp"
#include "tracking/point_scan.hpp"
#include "tracking/surface_tracking.hpp"

namespace dynmesh {

/// Registers the last good shape with a frame of which too many points are far from the surface.
/// Without `TrackerSettings::recover`, it does and stores nothing.
template <class Real>
class Recovery {
 public:
  /// In the internal order.
  using Frame = std::vector<Vector3<Real>>;

  /// `surface` and `numbering` must outlive this object.
  Recovery(SurfaceTracking& surface, const Numbering& numbering, std::size_t n_vertices,
           const TrackerSettings& settings);

  /// Begins a sequence.
  void begin(const Frame& first_frame) noexcept;

  /// Whether a frame is to be registered anew.
  [[nodiscard]] bool is_due(const Agreement& agreement) const;
  /// Registers it, and tracks it again from there. `found` is what the surface has just found, and
  /// becomes the better of both. Returns whether that is the new one; if not, nothing but time
  /// tells of the attempt. If it throws, the surface is as it was before the frame.
  bool improve(const PointScan& measurement, SurfaceTracking::Found& found);

  /// Remembers a frame, and whether it was registered anew.
  void remember(const Frame& completed, const Agreement& agreement, bool was_due) noexcept;

  struct Memory {
    Frame good;
    std::uint8_t pause = 0;
  };
  [[nodiscard]] std::size_t memory_size() const;
  void write_memory(Writer& writer) const;
  /// Refuses a memory that `write_memory` cannot have written.
  [[nodiscard]] Memory read_memory(Reader& reader) const;
  void recall(Memory memory) noexcept;

 private:
  [[nodiscard]] std::optional<std::vector<Vector3<double>>> registered(
      const PointScan& measurement) const;

  SurfaceTracking& surface_;
  const Numbering& numbering_;
  bool is_wanted_;
  Index threads_;
  // A scan that has been far from the surface from the start may show other things beside it.
  std::uint8_t none_good_;  // the pause that lasts until a frame is good
  Frame good_;              // the last frame that was not lost; empty if it is not wanted
  std::uint8_t pause_;      // the number of frames that are not registered
};

}  // namespace dynmesh
