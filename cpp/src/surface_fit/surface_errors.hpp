/// The standard errors of a tracked surface.
#pragma once

#include <dynmesh/types.hpp>
#include <span>
#include <vector>

#include "base/workers.hpp"
#include "shape/error_bars.hpp"
#include "shape/memory.hpp"
#include "shape/model.hpp"
#include "surface_fit/constants.hpp"
#include "surface_fit/materials.hpp"
#include "surface_fit/surface_level.hpp"

namespace dynmesh {

/// Carries the ensemble of errors of method detail from frame to frame, of which the rows of
/// measured points are the anchors.
class SurfaceErrors {
 public:
  /// All references must outlive this object. `factors` are of N with the membrane.
  SurfaceErrors(const ShapeModel& model, std::span<const Material> materials,
                Lender<MaskedFactor>& factors, const TrackingConstants& constants, Workers& workers,
                bool are_wanted);

  /// The errors of frame 0.
  [[nodiscard]] ErrorMemory no_errors() const { return bars_.no_errors(); }
  /// Finds the standard errors of a frame, of which `next` has the generations. Where the surface
  /// was lost, the far points show how far from it unseen vertices may be. Without errors, nothing
  /// happens.
  void measure(const FittedSurface& found, bool is_lost, const Memory& memory, Memory& next);

 private:
  const ShapeModel& model_;
  Lender<MaskedFactor>& factors_;
  const TrackingConstants& constants_;
  Workers& workers_;
  ErrorBars bars_;
};

}  // namespace dynmesh
