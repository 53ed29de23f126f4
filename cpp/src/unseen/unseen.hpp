/// What becomes of the vertices that no chain of edges ties to an anchor.
#pragma once

#include <cstddef>
#include <dynmesh/settings.hpp>
#include <dynmesh/topology.hpp>
#include <dynmesh/types.hpp>
#include <span>
#include <vector>

#include "generations/generations.hpp"

namespace dynmesh {

/// Moves the components of a frame that hold no anchor. Allocates in `reset` only.
template <class Real>
class Unseen {
 public:
  using Frame = std::span<const Vector3<Real>>;

  /// `topology` must outlive this object.
  Unseen(const Topology& topology, UnseenRule rule);

  /// Begins a sequence whose frame 0 is `first_frame`. Each vertex's donor is the vertex nearest to
  /// it, in that frame, of another component.
  void reset(Frame first_frame);

  /// Fills in the unseen vertices of `points`, where anchors and satellites already stand.
  ///
  /// Under `follow` a component takes the rigid motion, previous to current, of its distinct donors
  /// whose component holds at least four anchors; with fewer than four such donors that of all
  /// anchors; where these are on one line or fewer than three, their mean translation; without any
  /// anchor it stays. Linear in the vertices, and no work where none is unseen.
  void place(Frame previous, std::span<Vector3<Real>> points, const Generations& generations);

 private:
  [[nodiscard]] std::span<const Index> usable_donors(std::size_t component);

  const Topology* topology_;
  UnseenRule rule_;
  std::vector<Index> donors_;            // the distinct donors of each component, one after another
  std::vector<std::size_t> donor_ends_;  // those of component c end at donor_ends_[c + 1]
  std::vector<Index> members_;           // the vertices of each component, one after another
  std::vector<std::size_t> member_ends_;  // likewise
  std::vector<Index> anchors_in_;         // anchors of the frame in each component
  std::vector<Index> chosen_;             // vertices that a motion is fitted to
};

}  // namespace dynmesh
