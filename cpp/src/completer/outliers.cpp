#include "completer/outliers.hpp"

#include <algorithm>
#include <cmath>

#include "support/geometry.hpp"

namespace dynmesh {
namespace {

constexpr std::size_t fewest_neighbours = 3;
constexpr double most_deviations = 5;
constexpr double floor_in_edges = 1e-3;

}  // namespace

template <class Real>
Outliers<Real>::Outliers(const Cells& cells, Frame first_frame)
    : cells_(cells),
      mean_edge_(static_cast<double>(mean_edge_length(cells, first_frame))),
      found_from_(cells.size()) {
  found_.reserve(cells.size());
  deviations_.reserve(cells.size());
  sorted_.reserve(cells.size());
}

/// Searches breadth first.
template <class Real>
std::span<const Index> Outliers<Real>::nearest_anchors(Index anchor,
                                                       std::span<const std::uint8_t> known) {
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

template <class Real>
std::size_t Outliers<Real>::drop(Frame previous, Frame points, std::span<std::uint8_t> known) {
  std::ranges::fill(found_from_, -1);
  deviations_.clear();
  sorted_.clear();
  for (std::size_t v = 0; v < known.size(); ++v) {
    if (known[v] == 0) continue;
    const auto nearest = nearest_anchors(static_cast<Index>(v), known);
    if (nearest.size() < fewest_neighbours) continue;
    const auto motion = [&](std::size_t vertex, std::size_t axis) {
      const Vector3<Real> d = points[vertex] - previous[vertex];
      return static_cast<double>(axis == 0 ? d.x : axis == 1 ? d.y : d.z);
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

  const double least = std::max(median(sorted_), floor_in_edges * mean_edge_);
  std::size_t dropped = 0;
  for (const Deviation& deviation : deviations_) {
    if (!(deviation.own > most_deviations * std::max(deviation.around, least))) continue;
    known[deviation.anchor] = 0;
    ++dropped;
  }
  return dropped;
}

template class Outliers<float>;
template class Outliers<double>;

}  // namespace dynmesh
