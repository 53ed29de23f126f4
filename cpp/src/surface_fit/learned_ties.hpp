/// Ties between the components of a tracked surface, which let go of what moves apart.
#pragma once

#include <cstddef>
#include <cstdint>
#include <dynmesh/topology.hpp>
#include <dynmesh/types.hpp>
#include <span>
#include <vector>

#include "base/geometry.hpp"
#include "mesh/ties.hpp"
#include "shape/rotations.hpp"
#include "surface_fit/constants.hpp"

namespace dynmesh {

/// Ties with the weights of a frame.
struct WeightedTies {
  std::vector<Tie> all;  ///< those between components are the first
  /// 1 for each tie between components that has at least a quarter of its weight: s^2 is at most
  /// sigma^2.
  std::vector<std::uint8_t> hold;

  [[nodiscard]] std::span<const Tie> between() const { return std::span(all).first(hold.size()); }
};

/// The ties of a pair of components have the weight w = tau / (1 + s^2 / sigma^2)^2, a redescending
/// estimator (Geman and McClure 1985). s^2 is the mean square by which they depart from frame 0, in
/// squared mean edges: now, or in earlier frames, of which each counts less than the next. What
/// moves together stays tied, and what slides or leaves is let go, as soon as its points draw it
/// away. The ties of thin walls, within a component, have a fixed weight: no point shows how
/// thick they are.
class LearnedTies {
 public:
  /// `normals` (k,) are those of frame 0, outwards.
  LearnedTies(const Topology& topology, Field first_frame, Field normals, double mean_edge,
              const TrackingConstants& constants);

  /// All ties, with the weights of frame 0.
  [[nodiscard]] std::span<const Tie> all() const { return ties_; }
  /// All ties, with the weights for s^2 (pairs,).
  [[nodiscard]] WeightedTies weighted(std::span<const double> departures) const;
  /// The ties between components.
  [[nodiscard]] std::span<const Tie> between() const {
    return std::span(ties_).first(pair_of_.size());
  }
  /// (pairs,) s^2 of frame 0: as many as any frame 0 could have, so that all states of a mesh have
  /// the same size.
  [[nodiscard]] std::vector<double> no_departures() const {
    return std::vector<double>(most_pairs_, 0.0);
  }
  /// The difference X_i - X_j that is kept: that of frame 0, turned by Q.
  static Vector3 kept(const Tie& tie, std::span<const Quaternion> q) {
    return 0.5 * (rotated(q[tie.i], tie.kept) + rotated(q[tie.j], tie.kept));
  }

  /// (pairs,) s^2 for the differences that X should have, one for each tie between components,
  /// after frames that left `departures` (pairs,).
  [[nodiscard]] std::vector<double> departed(Field x, Field differences,
                                             std::span<const double> departures) const;
  /// (pairs,) s^2 for the differences that are kept.
  [[nodiscard]] std::vector<double> departed(Field x, std::span<const Quaternion> q,
                                             std::span<const double> departures) const;

 private:
  const TrackingConstants& constants_;
  double mean_edge_;
  std::vector<Tie> ties_;  // with the weights tau
  std::size_t n_pairs_ = 0;
  std::size_t most_pairs_;
  std::vector<std::uint32_t> pair_of_;  // of each tie between components, which are the first
};

}  // namespace dynmesh
