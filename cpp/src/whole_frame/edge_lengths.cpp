#include "whole_frame/edge_lengths.hpp"

#include <algorithm>
#include <cmath>
#include <optional>

#include "support/geometry.hpp"

namespace dynmesh {
namespace {

double log_length(const Vector3<double>& a, const Vector3<double>& b) {
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

/// Of each vertex in one frame: the pairs that enough frames know, and those that contradict them.
struct Votes {
  Index all = 0;
  Index against = 0;
};

template <class Real>
void count_votes(std::span<const VertexPair> pairs, std::span<const PairLength> lengths,
                 const Window<Real>& window, std::size_t frame,
                 const WholeFrameConstants& constants, std::vector<Votes>& votes) {
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    if (lengths[i].frames < constants.fewest_frames) continue;
    const auto logarithm = log_length(pairs[i], window, frame);
    if (!logarithm) continue;
    const bool contradicts =
        std::abs(*logarithm - lengths[i].median) >
        constants.outlier_distance + constants.outlier_spreads * lengths[i].spread;
    for (const Index v : pairs[i]) {
      ++votes[v].all;
      if (contradicts) ++votes[v].against;
    }
  }
}

void mark_contradicted(const std::vector<Votes>& votes, std::vector<std::uint8_t>& contradicted) {
  for (std::size_t v = 0; v < votes.size(); ++v) {
    if (votes[v].all > 0 && 2 * votes[v].against >= votes[v].all) contradicted[v] = 1;
  }
}

}  // namespace

std::vector<VertexPair> edges_of(const Cells& cells) {
  std::vector<VertexPair> edges;
  for (std::size_t i = 0; i < cells.size(); ++i) {
    const auto v = static_cast<Index>(i);
    for (const Index n : cells[v]) {
      if (v < n) edges.push_back({v, n});
    }
  }
  return edges;
}

std::vector<VertexPair> pairs_two_edges_apart(const Cells& cells) {
  std::vector<VertexPair> pairs;
  std::vector<Index> near_to(cells.size(), -1);  // the last vertex that a vertex is near to
  for (std::size_t i = 0; i < cells.size(); ++i) {
    const auto v = static_cast<Index>(i);
    near_to[i] = v;
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

template <class Real>
std::vector<PairLength> pair_lengths(std::span<const VertexPair> pairs, const Window<Real>& window,
                                     const WholeFrameConstants& constants) {
  std::vector<PairLength> lengths(pairs.size());
  std::vector<double> values;
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    values.clear();
    for (std::size_t t = 0; t < window.size(); ++t) {
      const auto logarithm = log_length(pairs[i], window, t);
      if (logarithm && std::isfinite(*logarithm)) values.push_back(*logarithm);
    }
    if (values.empty()) continue;
    PairLength& length = lengths[i];
    length.frames = values.size();
    length.median = median(values);
    for (double& value : values) value = std::abs(value - length.median);
    length.spread = constants.deviations_to_spread * median(values);
  }
  return lengths;
}

double typical_length(std::span<const PairLength> lengths) {
  std::vector<double> medians;
  for (const PairLength& length : lengths) {
    if (length.frames > 0) medians.push_back(length.median);
  }
  return medians.empty() ? 1 : std::exp(median(medians));
}

template <class Real>
void drop_outliers(const Cells& cells, Window<Real>& window, const WholeFrameConstants& constants) {
  const auto edges = edges_of(cells);
  const auto farther = pairs_two_edges_apart(cells);
  const auto of_edges = pair_lengths<Real>(edges, window, constants);
  const auto of_farther = pair_lengths<Real>(farther, window, constants);
  std::vector<Votes> votes(cells.size());
  for (std::size_t t = 0; t < window.size(); ++t) {
    std::ranges::fill(votes, Votes{});
    std::vector<std::uint8_t> contradicted(cells.size());
    count_votes<Real>(edges, of_edges, window, t, constants, votes);
    mark_contradicted(votes, contradicted);
    count_votes<Real>(farther, of_farther, window, t, constants, votes);
    mark_contradicted(votes, contradicted);
    for (std::size_t v = 0; v < votes.size(); ++v) {
      if (contradicted[v] != 0) window.known[t][v] = 0;
    }
  }
}

Deviation deviation_of(std::span<const VertexPair> edges, std::span<const PairLength> lengths,
                       std::span<const Vector3<double>> frame, std::span<const std::uint8_t> known,
                       const WholeFrameConstants& constants) {
  constexpr double shortest = -700;  // the logarithm of about the smallest number
  Deviation sum;
  double n = 0;
  for (std::size_t i = 0; i < edges.size(); ++i) {
    const auto a = static_cast<std::size_t>(edges[i][0]);
    const auto b = static_cast<std::size_t>(edges[i][1]);
    if (lengths[i].frames < constants.fewest_frames || (known[a] != 0 && known[b] != 0)) continue;
    sum.of_frame +=
        std::abs(std::max(log_length(frame[a], frame[b]), shortest) - lengths[i].median);
    sum.usual += constants.spread_to_deviation * lengths[i].spread;
    ++n;
  }
  return n > 0 ? Deviation{sum.of_frame / n, sum.usual / n} : Deviation{};
}

template std::vector<PairLength> pair_lengths(std::span<const VertexPair>, const Window<float>&,
                                              const WholeFrameConstants&);
template std::vector<PairLength> pair_lengths(std::span<const VertexPair>, const Window<double>&,
                                              const WholeFrameConstants&);
template void drop_outliers(const Cells&, Window<float>&, const WholeFrameConstants&);
template void drop_outliers(const Cells&, Window<double>&, const WholeFrameConstants&);

}  // namespace dynmesh
