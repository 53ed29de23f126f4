/// The parts of a tracker.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <dynmesh/settings.hpp>
#include <dynmesh/topology.hpp>
#include <dynmesh/tracker.hpp>
#include <dynmesh/types.hpp>
#include <memory>
#include <span>
#include <vector>

#include "completer/exchange.hpp"
#include "disconnected/disconnected.hpp"
#include "generations/generations.hpp"
#include "mesh/numbering.hpp"
#include "support/workers.hpp"
#include "tracking/depth_images.hpp"
#include "tracking/point_scan.hpp"
#include "tracking/surface_tracking.hpp"

namespace dynmesh {

/// The implementation of Tracker, which tracks frames after the public class has checked the
/// arguments. All arrays are in the internal order of vertices, as those of a completer.
template <class Real>
struct Tracker<Real>::Parts {
  using Clock = std::chrono::steady_clock;
  using Frame = std::vector<Vector3<Real>>;

  /// `first_frame` and the frames of the training sequence, x y z of each vertex, are in the
  /// caller's order.
  Parts(Faces faces, const Frame& first_frame, Topology caller_topology,
        const TrackerSettings& chosen, std::span<const std::vector<Real>> training = {});

  /// Begins a sequence. If memory is exhausted, nothing has changed.
  void begin(Frame new_first_frame);

  /// Finds the frame in what was measured.
  TrackingReport track(const Measurement& measurement, Points<Real> tracked,
                       Clock::time_point start);

  /// Sets what callers read, from `known` and `age`.
  void update_copies();

  /// The root mean square of the standard errors that are finite; 0 without any.
  [[nodiscard]] double mean_standard_error() const;

  [[nodiscard]] std::size_t n_vertices() const { return topology->cells.size(); }

  TrackerSettings settings;
  Numbering numbering;
  std::unique_ptr<const Topology> topology;
  // The following members refer to the two above and to each other.
  Workers workers;
  Exchange<Real> exchange;
  Generations generations;
  Disconnected<Real> disconnected;
  SurfaceTracking surface;

  PointScan scan;
  DepthImages images;
  Frame first_frame;
  Frame previous;
  Frame current;
  std::vector<Vector3<double>> completed;  // `current` in double precision
  std::vector<std::uint8_t> known;
  std::vector<Index> age;
  std::size_t n_frames = 0;
  TrackingReport report;
  std::uint64_t training_hash = 0;  // of its frames; 0 without training

  // In the caller's order:
  std::vector<std::uint8_t> observed_for_caller;
  std::vector<Index> generation_for_caller;
  std::vector<Index> age_for_caller;
  std::vector<Real> standard_error_for_caller;  // empty without `uncertainty`
};

}  // namespace dynmesh
