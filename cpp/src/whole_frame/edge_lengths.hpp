/// How long the edges of a mesh are where frames know both of their ends, and what contradicts it.
#pragma once

#include <array>
#include <cstddef>
#include <dynmesh/topology.hpp>
#include <dynmesh/types.hpp>
#include <limits>
#include <span>
#include <vector>

#include "whole_frame/constants.hpp"
#include "whole_frame/window.hpp"

namespace dynmesh {

using VertexPair = std::array<Index, 2>;

/// Each edge once.
std::vector<VertexPair> edges_of(const Cells& cells);
/// Pairs of vertices that share a neighbour but no edge, each once.
std::vector<VertexPair> pairs_two_edges_apart(const Cells& cells);

/// The logarithm of the distance of two vertices, over the frames that know both.
struct PairLength {
  double median = std::numeric_limits<double>::quiet_NaN();  ///< mu; NaN if no frame knows both
  double spread = std::numeric_limits<double>::quiet_NaN();  ///< sigma, from the median deviation
  std::size_t frames = 0;                                    ///< that know both, not at one place
};

/// Frames in which both are at one place do not count.
template <class Real>
std::vector<PairLength> pair_lengths(std::span<const VertexPair> pairs, const Window<Real>& window,
                                     const WholeFrameConstants& constants);

/// h, the median over the pairs of exp(median), or 1 if no frame knows any pair.
double typical_length(std::span<const PairLength> lengths);

/// Marks known positions that contradict other frames as not known: those of which at least half of
/// the pairs have another length than usual, among edges alone or among edges and pairs two edges
/// apart.
template <class Real>
void drop_outliers(const Cells& cells, Window<Real>& window, const WholeFrameConstants& constants);

/// How far the edges of a frame that have an end which is not known are from their usual lengths,
/// on average, as logarithms. Edges that fewer than three frames know do not count.
struct Deviation {
  double of_frame = 0;
  double usual = 0;  ///< of frames that know both ends
};
Deviation deviation_of(std::span<const VertexPair> edges, std::span<const PairLength> lengths,
                       std::span<const Vector3<double>> frame, std::span<const std::uint8_t> known,
                       const WholeFrameConstants& constants);

}  // namespace dynmesh
