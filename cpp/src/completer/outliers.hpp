/// Anchors that cannot be where they were observed.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <dynmesh/topology.hpp>
#include <dynmesh/types.hpp>
#include <span>
#include <vector>

namespace dynmesh {

/// An anchor is an outlier if its motion differs from the median of the eight anchors nearest to it
/// along edges by more than five times the larger of two medians: of what theirs differ from the
/// same median, and of what all anchors of the frame differ from that of theirs; the larger of both
/// is floored at a thousandth of the mean edge, or a limb that starts to move on a still body would
/// be one. Fewer than three other anchors in its component say nothing about an anchor.
template <class Real>
class Outliers {
 public:
  using Frame = std::span<const Vector3<Real>>;

  /// `cells` must outlive this object. Allocates here only.
  explicit Outliers(const Cells& cells);

  /// `first_frame` gives the mean edge.
  void reset(Frame first_frame);

  /// Sets `known` to 0 at the outliers of a frame, and returns how many there are. Linear in the
  /// edges, times eight.
  std::size_t drop(Frame previous, Frame points, std::span<std::uint8_t> known);

 private:
  static constexpr std::size_t most_neighbours = 8;

  struct Deviation {
    Index anchor;
    double own;     // from the median motion around it
    double around;  // the median of what its neighbours deviate from that
  };

  std::span<const Index> nearest_anchors(Index anchor, std::span<const std::uint8_t> known);

  const Cells& cells_;
  double mean_edge_ = 1;
  std::array<Index, most_neighbours> nearest_{};
  std::vector<Index> found_;       // of a search, in its order
  std::vector<Index> found_from_;  // (k,) the last anchor whose search came by
  std::vector<Deviation> deviations_;
  std::vector<double> sorted_;
};

}  // namespace dynmesh
