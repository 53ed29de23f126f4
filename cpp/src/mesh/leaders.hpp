/// Which component of a mesh another one moves with.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <dynmesh/topology.hpp>
#include <dynmesh/types.hpp>
#include <span>
#include <vector>

#include "base/lender.hpp"
#include "base/training_frames.hpp"

namespace dynmesh {

/// Finds for components of which little or nothing is known the ones that lead them: those that
/// touch them in frame 0, and that kept their distances to them where both were seen. Several lead
/// together as far as they move as parts of one rigid body.
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
  /// What leads all components that do not lead themselves, as far as there is a way: each by the
  /// one of the greatest trust, and others by their share of it.
  struct Leads {
    std::vector<Lead> leads;                    ///< the most trusted first
    std::vector<std::array<double, 2>> shares;  ///< (pairs,) of each component in leading the other
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

  /// Leads components by those that agree on how they moved from frame 0 to X, which need not be
  /// the frame itself. A way through a component that does not lead itself is trusted less.
  Lent<Leads> find(std::span<const std::uint8_t> may_lead, std::span<const double> departures,
                   Field x);
  /// Lowers the shares of what leads a component along with others, but moved otherwise from frame
  /// 0 to X than they, as parts of one rigid body, tell.
  void agree(const Lead& lead, Field x, Leads& leads);
  /// The lead of a component by another one that may lead, directly. Without trust if there is
  /// none.
  [[nodiscard]] Lead best(Index component, std::span<const std::uint8_t> may_lead,
                          std::span<const double> departures) const;

  /// Calls `visit(vertex, weight)` for vertices of the leader of a `best` lead that are near the
  /// follower.
  template <class Visit>
  void for_each_place(const Lead& lead, const Visit& visit) const {
    visit_places(lead.pair, lead.follower, 1, visit);
  }
  /// Calls `visit(vertex, weight)` for the places of all that the follower of a lead trusts about
  /// as much.
  template <class Visit>
  void for_each_place_around(const Lead& lead, const Leads& leads, const Visit& visit) const {
    for (const std::size_t pair : pairs_of_[static_cast<std::size_t>(lead.follower)]) {
      const double share = leads.shares[pair][pairs_[pair].side_of(lead.follower)];
      if (share > 0) visit_places(pair, lead.follower, share, visit);
    }
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

    [[nodiscard]] std::size_t side_of(Index component) const {
      return components[0] == component ? 0 : 1;
    }
  };

  template <class Visit>
  void visit_places(std::size_t number, Index follower, double share, const Visit& visit) const {
    const Pair& pair = pairs_[number];
    const std::size_t side = 1 - pair.side_of(follower);
    for (const Place& place : pair.places) visit(place.vertices[side], share * place.weight);
  }
  void find_pairs(const Topology& topology, std::size_t others);
  void choose_measured(Pair& pair) const;
  [[nodiscard]] double squared_departure(const Pair& pair, Field x) const;
  [[nodiscard]] Lead lead_of(Index follower, std::size_t number, double departure) const;
  [[nodiscard]] Lead trust_of(Index follower, std::size_t number,
                              std::span<const std::uint8_t> may_lead, double departure) const;
  void share_out(const Lead& lead, std::span<const std::uint8_t> may_lead,
                 std::span<const double> departures, Leads& leads) const;
  [[nodiscard]] bool is_better(const Lead& lead, const Lead& than) const;

  Field first_frame_;
  double mean_edge_;
  double scale_;  // a power of two, with which no position is rounded, that makes edges about 1
  double squared_edge_ = 1;  // the square of the mean one, scaled
  std::vector<Index> rank_;  // (components,) in an order that does not depend on their numbers
  std::vector<Pair> pairs_;
  std::vector<std::vector<std::size_t>> pairs_of_;  // of each component
  std::vector<double> trained_;
  Lender<Leads> leads_;
  // Buffers:
  struct Beside {
    double* share;
    double trust;
    std::span<const Index> vertices;
    double square = 0;
  };
  std::vector<Lead> of_component_;
  std::vector<Beside> beside_;
};

}  // namespace dynmesh
