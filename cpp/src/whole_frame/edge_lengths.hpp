/// How long the edges of a mesh are where frames know both of their ends, and what contradicts it.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <dynmesh/topology.hpp>
#include <dynmesh/types.hpp>
#include <limits>
#include <optional>
#include <span>
#include <utility>
#include <vector>

#include "base/geometry.hpp"
#include "base/statistics.hpp"
#include "whole_frame/window.hpp"

namespace dynmesh {

using VertexPair = std::array<Index, 2>;

/// The logarithm of the distance of two vertices, over the frames that know both.
struct PairLength {
  double median = std::numeric_limits<double>::quiet_NaN();  ///< mu; NaN if no frame knows both
  double spread = std::numeric_limits<double>::quiet_NaN();  ///< sigma, from the median deviation
  std::size_t frames = 0;                                    ///< that know both, not at one place

  /// Lengths that fewer frames know say nothing of what is usual.
  [[nodiscard]] bool tells() const { return frames >= 3; }
};

/// Each edge once.
inline std::vector<VertexPair> edges_of(const Cells& cells) {
  std::vector<VertexPair> edges;
  for (Index v = 0; v < static_cast<Index>(cells.size()); ++v) {
    for (const Index n : cells[v]) {
      if (v < n) edges.push_back({v, n});
    }
  }
  return edges;
}

/// Pairs of vertices that share a neighbour but no edge, each once.
inline std::vector<VertexPair> pairs_two_edges_apart(const Cells& cells) {
  std::vector<VertexPair> pairs;
  std::vector<Index> near_to(cells.size(), -1);  // the last vertex that a vertex is near to
  for (Index v = 0; v < static_cast<Index>(cells.size()); ++v) {
    near_to[v] = v;
    for (const Index n : cells[v]) near_to[n] = v;
    for (const Index n : cells[v]) {
      for (const Index far : cells[n]) {
        if (near_to[far] == v) continue;
        near_to[far] = v;
        if (v < far) pairs.push_back({v, far});
      }
    }
  }
  return pairs;
}

inline double log_length(const Vector3& a, const Vector3& b) {
  const auto edge = a - b;
  return std::log(std::hypot(edge.x, edge.y, edge.z));
}

/// The same in a frame, if it knows both ends.
template <class Real>
std::optional<double> log_length(const VertexPair& pair, const Window<Real>& window,
                                 std::size_t frame) {
  const auto [a, b] = pair;
  if (!window.is_known(frame, a) || !window.is_known(frame, b)) return std::nullopt;
  return log_length(window.position(frame, a), window.position(frame, b));
}

inline PairLength length_of(std::vector<double> logarithms) {
  constexpr double deviations_to_spread = 1.48;  // of a normal distribution
  if (logarithms.empty()) return {};
  PairLength length;
  length.frames = logarithms.size();
  length.median = median(logarithms);
  for (double& value : logarithms) value = std::abs(value - length.median);
  length.spread = deviations_to_spread * median(logarithms);
  return length;
}

/// Frames in which both are at one place do not count.
template <class Real>
std::vector<PairLength> pair_lengths(std::span<const VertexPair> pairs,
                                     const Window<Real>& window) {
  std::vector<PairLength> lengths;
  std::vector<double> values;
  for (const VertexPair& pair : pairs) {
    values.clear();
    for (std::size_t t = 0; t < window.size(); ++t) {
      const auto logarithm = log_length(pair, window, t);
      if (logarithm && std::isfinite(*logarithm)) values.push_back(*logarithm);
    }
    lengths.push_back(length_of(values));
  }
  return lengths;
}

/// The median over the pairs of their logarithms, and the spread of these.
inline PairLength typical_length(std::span<const PairLength> lengths) {
  std::vector<double> medians;
  for (const PairLength& length : lengths) {
    if (length.frames > 0) medians.push_back(length.median);
  }
  return length_of(std::move(medians));
}

/// Marks known positions that contradict other frames as not known: those of which at least half of
/// the pairs have another length than usual, among edges alone or among edges and pairs two edges
/// apart.
template <class Real>
void drop_outliers(const Cells& cells, Window<Real>& window) {
  // A pair contradicts the other frames if the logarithm of its distance is this far from their
  // median, and this many of their spreads.
  constexpr double outlier_distance = 0.7;
  constexpr double outlier_spreads = 4;
  const auto edges = edges_of(cells);
  const auto farther = pairs_two_edges_apart(cells);
  const auto of_edges = pair_lengths<Real>(edges, window);
  const auto of_farther = pair_lengths<Real>(farther, window);
  for (std::size_t t = 0; t < window.size(); ++t) {
    std::vector<Index> n_pairs(cells.size()), n_against(cells.size());  // of each vertex
    std::vector<std::uint8_t> kept = window.known[t];
    const auto count = [&](std::span<const VertexPair> pairs, std::span<const PairLength> usual) {
      for (std::size_t i = 0; i < pairs.size(); ++i) {
        if (!usual[i].tells()) continue;
        const auto logarithm = log_length(pairs[i], window, t);
        if (!logarithm) continue;
        const bool contradicts = std::abs(*logarithm - usual[i].median) >
                                 outlier_distance + outlier_spreads * usual[i].spread;
        for (const Index v : pairs[i]) {
          ++n_pairs[v];
          n_against[v] += contradicts ? 1 : 0;
        }
      }
      for (std::size_t v = 0; v < kept.size(); ++v) {
        if (n_pairs[v] > 0 && 2 * n_against[v] >= n_pairs[v]) kept[v] = 0;
      }
    };
    count(edges, of_edges);
    count(farther, of_farther);
    window.known[t] = std::move(kept);
  }
}

/// How far the edges of a frame that have an end which is not known are from their usual lengths,
/// on average, as logarithms. Those that fewer than three frames know may be torn: they are
/// compared with the longest of the others. Where they are short, little can be wrong.
struct Deviation {
  double of_frame = 0;
  double usual = 0;  ///< of frames that know both ends
};
inline Deviation deviation_of(std::span<const VertexPair> edges,
                              std::span<const PairLength> lengths, Field frame,
                              std::span<const std::uint8_t> known) {
  constexpr double shortest = -700;             // the logarithm of about the smallest number
  constexpr double spread_to_deviation = 0.84;  // the mean absolute one of a normal distribution
  constexpr double unusual = 4;                 // spreads
  const PairLength typical = typical_length(lengths);
  Deviation sum;
  double n = 0;
  for (std::size_t i = 0; i < edges.size(); ++i) {
    const auto [a, b] = edges[i];
    if (known[a] != 0 && known[b] != 0) continue;
    const double length = std::max(log_length(frame[a], frame[b]), shortest);
    if (lengths[i].tells()) {
      sum.of_frame += std::abs(length - lengths[i].median);
      sum.usual += spread_to_deviation * lengths[i].spread;
      ++n;
    } else if (typical.tells()) {
      sum.of_frame += std::max(length - typical.median - unusual * typical.spread, 0.0);
      ++n;
    }
  }
  return n > 0 ? Deviation{sum.of_frame / n, sum.usual / n} : Deviation{};
}

}  // namespace dynmesh
