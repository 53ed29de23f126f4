/// What sensors should see of a surface.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "base/workers.hpp"
#include "quality/coverage.hpp"
#include "surface_fit/point_scan.hpp"

namespace dynmesh {

/// What sensors should see of a surface, and where they saw through it; (k,) each, 1 for such
/// vertices.
struct Sight {
  std::vector<std::uint8_t> seen;
  std::vector<std::uint8_t> seen_through;
  std::vector<std::uint8_t> faced;  ///< what is seen, but for what all sensors see too flatly
};

struct SightSettings {
  double near = 0;  ///< what is less before a vertex belongs to the surface
  /// (k,) 1 for vertices that are seen if there are no sensors; empty if the surface is looked at
  /// from far away on all sides then.
  std::span<const std::uint8_t> without_sensors = {};
  bool shows_insides = true;  ///< whether sheets are seen from behind
};

/// Looks at a surface from where the sensors stand. A vertex is seen that is measured, (k,), or
/// that faces a sensor while neither the surface itself nor anything else lies before it. It is
/// seen through if all that was measured around the line of sight lies behind it, by more than the
/// noise. Without sensors, nothing is seen through.
Sight sight_of(const BentSurface& surface, const PointScan& scan,
               std::span<const std::uint8_t> is_measured, double noise,
               const SightSettings& settings, Workers& workers);

/// What lies less than this many mean edges before a vertex is its own slope.
inline constexpr double slope_depth = 1.5;

}  // namespace dynmesh
