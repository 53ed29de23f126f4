/// Detects anchors whose observed positions are wrong.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <dynmesh/topology.hpp>
#include <dynmesh/types.hpp>
#include <span>
#include <vector>

namespace dynmesh {

/// The motion of an anchor is compared with the median motion of the eight anchors nearest to it
/// along edges. The anchor is an outlier if its deviation from that median is more than five times
/// the largest of: the median deviation of these eight anchors from the same median; the median
/// deviation of all anchors of the frame; and a thousandth of the mean edge length. Without the
/// last two, a limb that starts to move on a body at rest would be an outlier. An anchor with fewer
/// than three other anchors in its component is never an outlier.
template <class Real>
class Outliers {
 public:
  using Frame = std::span<const Vector3<Real>>;

  /// `cells` must outlive this object. Allocates memory only in the constructor.
  Outliers(const Cells& cells, Frame first_frame);

  /// Sets `known` to 0 for the outliers of a frame and returns their number. The time is linear in
  /// the number of edges, times eight.
  std::size_t drop(Frame previous, Frame points, std::span<std::uint8_t> known);

 private:
  static constexpr std::size_t most_neighbours = 8;

  struct Deviation {
    Index anchor;
    double own;     // the deviation from the median motion around the anchor
    double around;  // the median of the deviations of its neighbours from it
  };

  std::span<const Index> nearest_anchors(Index anchor, std::span<const std::uint8_t> known);

  const Cells& cells_;
  double mean_edge_;  // of frame 0
  std::array<Index, most_neighbours> nearest_{};
  std::vector<Index> found_;       // the vertices that a search has found, in order
  std::vector<Index> found_from_;  // (k,) the last anchor whose search reached the vertex
  std::vector<Deviation> deviations_;
  std::vector<double> sorted_;
};

}  // namespace dynmesh
