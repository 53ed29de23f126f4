/// Detects anchors whose observed positions are wrong.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <dynmesh/topology.hpp>
#include <dynmesh/types.hpp>
#include <span>
#include <vector>

#include "base/geometry.hpp"
#include "base/statistics.hpp"

namespace dynmesh {

/// The motion of an anchor is compared with the median motion of the eight anchors nearest to it
/// along edges. The anchor is an outlier if its deviation from that median is more than five times
/// the largest of: the median deviation of these eight anchors from the same median; the median
/// deviation of all anchors of the frame; and a thousandth of the mean edge length. Without the
/// last two, a limb that starts to move on a body at rest would be an outlier. An anchor with fewer
/// than three other anchors in its component is never an outlier.
class Outliers {
 public:
  /// `cells` must outlive this object. Allocates memory only in the constructor.
  Outliers(const Cells& cells, Field first_frame)
      : cells_(cells), mean_edge_(mean_edge_length(cells, first_frame)), found_from_(cells.size()) {
    found_.reserve(cells.size());
    deviations_.reserve(cells.size());
    sorted_.reserve(cells.size());
  }

  /// Sets `known` to 0 for the outliers of a frame and returns their number. The time is linear in
  /// the number of edges, times eight.
  std::size_t drop(Field previous, Field points, std::span<std::uint8_t> known) {
    std::ranges::fill(found_from_, -1);
    deviations_.clear();
    sorted_.clear();
    for (std::size_t v = 0; v < known.size(); ++v) {
      if (known[v] == 0) continue;
      const auto nearest = nearest_anchors(static_cast<Index>(v), known);
      if (nearest.size() < 3) continue;
      const auto motion = [&](std::size_t vertex, std::size_t axis) {
        const Vector3 d = points[vertex] - previous[vertex];
        return axis == 0 ? d.x : axis == 1 ? d.y : d.z;
      };
      std::array<double, most_neighbours> around{};
      double own = 0;
      for (std::size_t axis = 0; axis < 3; ++axis) {
        std::array<double, most_neighbours> motions{};
        for (std::size_t n = 0; n < nearest.size(); ++n) motions[n] = motion(at(nearest[n]), axis);
        auto sorted = motions;
        const double middle = median({sorted.data(), nearest.size()});
        for (std::size_t n = 0; n < nearest.size(); ++n) {
          around[n] = std::hypot(around[n], motions[n] - middle);
        }
        own = std::hypot(own, motion(v, axis) - middle);
      }
      deviations_.push_back({static_cast<Index>(v), own, median({around.data(), nearest.size()})});
      sorted_.push_back(own);
    }
    if (deviations_.empty()) return 0;

    const double least = std::max(median(sorted_), 1e-3 * mean_edge_);
    std::size_t dropped = 0;
    for (const Deviation& deviation : deviations_) {
      if (!(deviation.own > 5 * std::max(deviation.around, least))) continue;
      known[deviation.anchor] = 0;
      ++dropped;
    }
    return dropped;
  }

 private:
  static constexpr std::size_t most_neighbours = 8;

  struct Deviation {
    Index anchor;
    double own;     // the deviation from the median motion around the anchor
    double around;  // the median of the deviations of its neighbours from it
  };

  /// Searches breadth first.
  std::span<const Index> nearest_anchors(Index anchor, std::span<const std::uint8_t> known) {
    std::size_t count = 0;
    found_.assign(1, anchor);
    found_from_[anchor] = anchor;
    for (std::size_t next = 0; next < found_.size(); ++next) {
      for (const Index n : cells_[found_[next]]) {
        if (found_from_[n] == anchor) continue;
        found_from_[n] = anchor;
        found_.push_back(n);
        if (known[n] == 0) continue;
        nearest_[count++] = n;
        if (count == most_neighbours) return nearest_;
      }
    }
    return {nearest_.data(), count};
  }

  const Cells& cells_;
  double mean_edge_;  // of frame 0
  std::array<Index, most_neighbours> nearest_{};
  std::vector<Index> found_;       // the vertices that a search has found, in order
  std::vector<Index> found_from_;  // (k,) the last anchor whose search reached the vertex
  std::vector<Deviation> deviations_;
  std::vector<double> sorted_;
};

}  // namespace dynmesh
