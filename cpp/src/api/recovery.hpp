/// What a tracker does when the template is lost.
#pragma once

#include <cstdint>
#include <dynmesh/quality.hpp>
#include <dynmesh/types.hpp>
#include <optional>
#include <vector>

#include "api/stream.hpp"
#include "quality/coverage.hpp"
#include "registration/pose_search.hpp"
#include "shape/memory.hpp"
#include "surface_fit/point_scan.hpp"
#include "surface_fit/surface_fit.hpp"

namespace dynmesh {

/// Judges frames, and seeks the template in those in which it is lost, from the last good frame
/// and, at most once in ten frames, by a registration; see TrackerSettings::recover.
class Recovery {
 public:
  using Frame = std::vector<Vector3>;

  /// `mesh` and `first_frame` must outlive this object.
  Recovery(Stream& mesh, const SurfaceLevel& surface, const Frame& first_frame, bool is_wanted);

  /// What is remembered of frame 0.
  void begin(Memory& memory) const;

  /// Where a surface was found that was sought.
  struct From {
    bool registration;  ///< a good one
    bool lost;          ///< another pose in the same frame that was lost, and may be as wrong
  };
  /// How the surface lies in the scan in which it was found.
  [[nodiscard]] Measure measure(const Memory& memory, const FittedSurface& found,
                                const From& from = {false, false}) const;
  /// Whether to seek the template elsewhere: it was lost in a frame, after a good one, or much
  /// suddenly speaks against it, as if some of its parts were.
  [[nodiscard]] bool is_due(const Memory& memory, const Measure& measure) const;

  /// What was found, or sought elsewhere.
  struct Sought {
    Memory start, next;  ///< from which the surface was found, and what `fit` wrote
    FittedSurface found = {};
    Measure measure = {};
    bool is_better = false;  ///< than what was found before
    bool by_registration = false;
  };
  /// Seeks the template from elsewhere than in `memory`, from which `found` was found, unless the
  /// points are of no surface. The search goes on until a result is good; else, the one with the
  /// least doubt replaces a lost one.
  Sought seek(SurfaceFit& surface, const Memory& memory, const PointScan& measurement,
              const FittedSurface& found, const Measure& measure, const Memory& next) const;

  /// Remembers the completed frame, and whether and how it was sought elsewhere. A state that was
  /// found there is the good one after some frames: a single one may be of something else.
  void remember(const Memory& memory, const Measure& measure, const std::optional<Sought>& sought,
                Memory& next) const;

  /// Refuses what no frames can have left.
  static void check(const Memory& memory);

 private:
  [[nodiscard]] BentSurface bent(Field x, Field normals) const;
  [[nodiscard]] bool are_of_a_surface(const FittedSurface& found) const;
  [[nodiscard]] std::optional<Pose> registered(const Frame& shape,
                                               const PointScan& measurement) const;

  Stream& mesh_;
  const SurfaceLevel& surface_;
  std::vector<std::uint8_t> is_sheet_;  // (k,)
  std::vector<std::uint8_t> seen_;      // (k,) of frame 0, from all sides
  bool is_wanted_;
  const Frame& first_;
  double size_;  // of frame 0
};

}  // namespace dynmesh
