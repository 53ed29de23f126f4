/// Which component of a mesh another one moves with.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <dynmesh/topology.hpp>
#include <dynmesh/types.hpp>
#include <span>
#include <vector>

#include "base/training_frames.hpp"

namespace dynmesh {

/// Finds for components of which little or nothing is known the ones that lead them: those that
/// touch them in frame 0, and that kept their distances to them where both were seen.
///
/// The weight of a pair of components is n / (1 + s^2 / sigma^2)^2. n, from 0 to 1, is the share of
/// one of both that touches the other: the mean of 1 / (1 + d^2), with d the distance of a vertex
/// from the other component in frame 0, in mean edges. s^2 is the departure of the pair, the mean
/// square by which distances from one to the other have changed since frame 0, in squared mean
/// edges: in the last frame in which both were seen, or in earlier ones, of which each counts less
/// than the next.
///
/// No result depends on the numbers of vertices and components. Allocates memory only in the
/// constructor.
class Leaders {
 public:
  /// One component moves as another one does.
  struct Lead {
    Index follower = 0;
    Index leader = 0;
    std::size_t pair = 0;
    double trust = 0;  ///< the product of the weights on the way to a component that may lead
  };

  /// `first_frame` must outlive this object. `training` are frames of a training
  /// sequence, or none.
  Leaders(const Topology& topology, Field first_frame, const TrainingFrames& training);

  [[nodiscard]] double mean_edge() const { return mean_edge_; }

  /// s^2 in frame 0: how far the pairs departed in the training frames. There are as many for each
  /// frame 0 of the mesh.
  [[nodiscard]] const std::vector<double>& departures() const { return trained_; }
  /// Finds s^2 after the frame X, from those before it. Only pairs of which both components are
  /// seen depart or come back.
  void learn(Field x, std::span<const std::uint8_t> is_seen, std::span<const double> departures,
             std::span<double> next) const;

  /// Leads all components that do not lead themselves, as far as there is a way: each by the one of
  /// the greatest trust, the most trusted first. A way through a component that does not lead
  /// itself is trusted less. Valid until the next call.
  std::span<const Lead> find(std::span<const std::uint8_t> may_lead,
                             std::span<const double> departures);
  /// The lead of a component by another one that may lead, directly. Without trust if there is
  /// none.
  [[nodiscard]] Lead best(Index component, std::span<const std::uint8_t> may_lead,
                          std::span<const double> departures) const;

  /// Calls `visit(vertex, weight)` for vertices of the leader that are near the follower.
  template <class Visit>
  void for_each_place(const Lead& lead, const Visit& visit) const {
    const Pair& pair = pairs_[lead.pair];
    const std::size_t side = pair.components[0] == lead.leader ? 0 : 1;
    for (const Place& place : pair.places) visit(place.vertices[side], place.weight);
  }

 private:
  struct Place {
    std::array<Index, 2> vertices{};  // of both components, near each other
    double weight = 0;                // 1 / (1 + d^2)
  };
  struct Pair {
    std::array<Index, 2> components{};
    std::array<double, 2> nearness{};  // of each to the other
    std::vector<Place> places;
    std::array<std::vector<Index>, 2> measured;  // some vertices of each of these, well spread
  };

  void find_pairs(const Topology& topology, std::size_t others);
  void choose_measured(Pair& pair) const;
  [[nodiscard]] double squared_departure(const Pair& pair, Field x) const;
  [[nodiscard]] Lead lead_of(Index follower, std::size_t number, double departure) const;
  [[nodiscard]] bool is_better(const Lead& lead, const Lead& than) const;

  Field first_frame_;
  double mean_edge_;
  double scale_;             // to mean edges
  std::vector<Index> rank_;  // (components,) in an order that does not depend on their numbers
  std::vector<Pair> pairs_;
  std::vector<std::vector<std::size_t>> pairs_of_;  // of each component
  std::vector<double> trained_;
  std::vector<Lead> of_component_, leads_;  // of one call
};

}  // namespace dynmesh
