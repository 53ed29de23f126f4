/// The last stage of a registration: the whole surface is drawn into the scan.
#pragma once

#include <dynmesh/types.hpp>
#include <optional>
#include <span>
#include <vector>

#include "mesh/training_frames.hpp"
#include "registration/constants.hpp"
#include "stream/stream.hpp"
#include "tracking/point_scan.hpp"
#include "tracking/surface_tracking.hpp"

namespace dynmesh {

/// Tracks the same scan again and again, until the surface stops.
class FineRounds {
 public:
  using Field = std::span<const Vector3<double>>;

  /// `stream` must outlive this object. `training` is in its order.
  FineRounds(std::vector<Triangle> faces, Stream<double>& stream, TrainingFrames training,
             bool has_uncertainty, double epsilon, const RegistrationConstants& constants,
             const TrackingConstants& tracking);

  struct Result {
    std::size_t rounds = 0;
    bool converged = false;
  };
  /// Begins with the positions `start` of the template `first_frame`, both in the order of
  /// `stream`, in which the result is then the last frame. Takes at most so many rounds.
  Result run(const PointScan& scan, Field first_frame, Field start, int most_rounds);

  /// (k,) the standard errors of the result.
  [[nodiscard]] std::span<const double> standard_errors() const {
    return surface_->shape().error_bars().of_vertices();
  }

 private:
  double take(const PointScan& scan);

  const RegistrationConstants& constants_;
  Stream<double>& stream_;
  std::vector<Triangle> faces_;
  TrainingFrames training_;
  bool has_uncertainty_;
  double epsilon_;
  TrackingConstants tracking_;
  std::optional<SurfaceTracking> surface_;
  std::vector<double> written_;
};

}  // namespace dynmesh
