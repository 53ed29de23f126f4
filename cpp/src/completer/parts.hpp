/// What a completer is made of.
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
#include "generations/estimator.hpp"
#include "generations/generations.hpp"
#include "mesh/numbering.hpp"
#include "support/workers.hpp"
#include "unseen/unseen.hpp"

namespace dynmesh {

/// The public class checks arguments; this completes frames. Everything is numbered by the places
/// of vertices in memory, which are the caller's numbers unless these scatter neighbours over a
/// large mesh.
template <class Real>
struct Completer<Real>::Parts {
  using Clock = std::chrono::steady_clock;
  using Frame = std::vector<Vector3<Real>>;

  /// `first_frame` is in the caller's order.
  Parts(Faces faces, const Frame& first_frame, Topology caller_topology, const Settings& chosen);

  /// Begins a sequence. Where memory runs out, everything is as it was.
  void begin(Frame new_first_frame);

  /// Takes a row for each vertex to `current` and `known`; without a mask those that are finite are
  /// anchors. Refuses anchors that are out of range.
  void read(Points<const Real> points, KnownMask mask);

  /// Completes the frame whose anchors stand in `known` and `current`.
  FrameReport complete(Points<Real> completed, Clock::time_point start);

  [[nodiscard]] std::size_t n_vertices() const { return topology->cells.size(); }
  [[nodiscard]] std::span<const Index> generation() const;
  [[nodiscard]] std::span<const Index> age_of_vertices() const;

  Settings settings;
  Numbering numbering;
  std::unique_ptr<const Topology> topology;
  // These refer to the two above and to one another.
  Workers workers;
  Exchange<Real> exchange;
  std::unique_ptr<Outliers<Real>> outliers;  // null where none are looked for
  Generations generations;
  std::unique_ptr<Estimator<Real>> estimator;
  Unseen<Real> unseen;

  Frame first_frame;
  Frame previous;                   // the last completed frame, V
  Frame current;                    // the frame in the making
  std::vector<std::uint8_t> known;  // its anchors
  std::vector<Index> age;
  FrameReport report;

 private:
  std::span<const Index> in_caller_order(std::span<const Index> values,
                                         std::vector<Index>& copy) const;

  // The last frame's in the caller's order, if vertices lie in another; empty until asked for.
  mutable std::vector<Index> generation_for_caller_;
  mutable std::vector<Index> age_for_caller_;
};

}  // namespace dynmesh
