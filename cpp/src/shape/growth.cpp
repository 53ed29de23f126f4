#include "shape/growth.hpp"

#include <algorithm>
#include <cmath>

#include "base/statistics.hpp"
#include "mesh/clusters.hpp"
#include "shape/constants.hpp"

namespace dynmesh {

bool any_grown(std::span<const double> sizes) {
  return std::ranges::any_of(sizes, [](double size) { return size != 1; });
}

Growth::Growth(const ShapeModel& model) : model_(model), edges_(model.topology.report.components) {
  const Cells& cells = model.topology.cells;
  std::vector<Index> rank(model.size());
  const std::vector<Index> order = in_order(cells, model.first_frame);
  for (std::size_t i = 0; i < order.size(); ++i) rank[order[i]] = static_cast<Index>(i);
  std::size_t most = 0;
  for (const Index a : order) {
    auto& edges = edges_[model.topology.component[a]];
    for (const Index b : cells[a]) {
      if (rank[b] < rank[a]) continue;
      const double square = square_of(a, b, model.first_frame);
      if (square > 0 && std::isfinite(square)) edges.push_back({a, b, square});
    }
    most = std::max(most, edges.size());
  }
  between_anchors_.reserve(most);
  ratios_.reserve(growth_constants.most_edges);
}

/// Of an edge in mean edges.
double Growth::square_of(Index a, Index b, Field frame) const {
  return squared_norm((1 / model_.mean_edge) * (frame[b] - frame[a]));
}

void Growth::find(std::span<const std::uint8_t> known, Field observed, Since since,
                  std::span<double> sizes) {
  const double rounding =
      std::sqrt(model_.rounding.mean_square_of_positions(observed)) / model_.mean_edge;
  for (std::size_t c = 0; c < sizes.size(); ++c) {
    const double from = since == Since::last_frame ? sizes[c] : 1;
    between_anchors_.clear();
    for (std::size_t e = 0; e < edges_[c].size(); ++e) {
      const auto& [a, b, _] = edges_[c][e];
      if ((known[a] & known[b]) != 0) between_anchors_.push_back(static_cast<Index>(e));
    }
    // Evenly, but at changing places within a step, so that edges of a regular grid have any
    // direction.
    ratios_.clear();
    const std::size_t n = between_anchors_.size();
    const std::size_t n_chosen = std::min(n, growth_constants.most_edges);
    for (std::size_t i = 0; i < n_chosen; ++i) {
      const std::size_t first = i * n / n_chosen;
      const std::size_t last = (i + 1) * n / n_chosen;
      const Edge& edge = edges_[c][between_anchors_[first + i * 7919 % (last - first)]];
      const double ratio = square_of(edge.a, edge.b, observed) / (edge.square * from * from);
      if (std::isfinite(ratio) && ratio > 0) ratios_.push_back(ratio);
    }
    const std::size_t fewest = since == Since::last_frame ? 1 : growth_constants.fewest_measured;
    if (ratios_.size() < fewest) continue;
    const double largest = growth_constants.largest_size;
    sizes[c] = std::clamp(grown(from, sizes[c], rounding), 1 / largest, largest);
  }
}

/// The size that the ratios to those of size `from` tell: by their median, less the more they
/// differ and the fewer they are; or the `last` one. `rounding` is that of a coordinate, in mean
/// edges.
double Growth::grown(double from, double last, double rounding) {
  const auto n = static_cast<double>(ratios_.size());
  const double middle = median(ratios_);
  const double growth = std::log(middle) / 2;
  if (!(std::abs(growth) < std::log(growth_constants.largest_step))) return last;
  for (double& ratio : ratios_) ratio = std::abs(ratio / middle - 1) / 2;
  const double usual = growth_constants.deviations * median(ratios_);
  const double spread = std::hypot(usual, rounding) * std::sqrt(1 + growth_constants.few / n);
  return from * std::exp(std::clamp(std::abs(growth) / spread - 1, 0.0, 1.0) * growth);
}

}  // namespace dynmesh
