/// The parts of a completer.
#pragma once

#include <chrono>
#include <cstddef>
#include <cstdint>
#include <dynmesh/completer.hpp>
#include <dynmesh/settings.hpp>
#include <dynmesh/topology.hpp>
#include <dynmesh/types.hpp>
#include <memory>
#include <span>
#include <vector>

#include "completer/exchange.hpp"
#include "completer/outliers.hpp"
#include "disconnected/disconnected.hpp"
#include "generations/estimator.hpp"
#include "generations/generations.hpp"
#include "mesh/numbering.hpp"
#include "support/workers.hpp"

namespace dynmesh {

/// The implementation of Completer, which completes frames after the public class has checked the
/// arguments. All arrays are in the internal order of vertices, which is that of the caller unless
/// it scatters neighbours over a large mesh.
template <class Real>
struct Completer<Real>::Parts {
  using Clock = std::chrono::steady_clock;
  using Frame = std::vector<Vector3<Real>>;

  /// `first_frame` and the frames of the training sequence, x y z of each vertex, are in the
  /// caller's order.
  Parts(Faces faces, const Frame& first_frame, Topology caller_topology, const Settings& chosen,
        std::span<const std::vector<Real>> training = {});

  /// Begins a sequence. If memory is exhausted, nothing has changed.
  void begin(Frame new_first_frame);

  /// Reads a row for each vertex into `current` and `known`. Without a mask, finite rows are
  /// anchors. Refuses anchors that are out of range.
  void read(Points<const Real> points, KnownMask mask);

  /// Completes the frame whose anchors have been read into `known` and `current`.
  FrameReport complete(Points<Real> completed, Clock::time_point start);

  [[nodiscard]] std::size_t n_vertices() const { return topology->cells.size(); }
  [[nodiscard]] std::span<const Index> generation() const;
  [[nodiscard]] std::span<const Index> age_of_vertices() const;
  [[nodiscard]] std::span<const Real> standard_error() const;
  /// The root mean square of the standard errors of the satellites; 0 without any.
  [[nodiscard]] double mean_standard_error() const;

  Settings settings;
  Numbering numbering;
  std::unique_ptr<const Topology> topology;
  // The following members refer to the two above and to each other.
  Workers workers;
  Exchange<Real> exchange;
  std::unique_ptr<Outliers<Real>> outliers;  // null if outliers are not rejected
  Generations generations;
  std::unique_ptr<Estimator<Real>> estimator;
  Disconnected<Real> disconnected;

  Frame first_frame;
  Frame previous;                   // the last completed frame, V
  Frame current;                    // the frame being completed
  std::vector<std::uint8_t> known;  // the known mask of the current frame
  std::vector<Index> age;
  std::size_t n_frames = 0;  // completed since `begin`
  FrameReport report;
  std::uint64_t training_hash = 0;  // of its frames; 0 without training

 private:
  void update_ages();
  [[nodiscard]] FrameReport report_of(Index iterations, std::size_t rejected,
                                      Clock::time_point start) const;
  std::span<const Index> in_caller_order(std::span<const Index> values,
                                         std::vector<Index>& copy) const;

  // Values of the last frame in the caller's order, if it differs from the internal one. They are
  // empty until requested.
  mutable std::vector<Index> generation_for_caller_;
  mutable std::vector<Index> age_for_caller_;
  mutable std::vector<Real> standard_error_for_caller_;
};

}  // namespace dynmesh
