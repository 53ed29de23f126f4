/// The inner loops of method motion, as fast as the processor allows.
///
/// motion.cpp says the same in plain words, and the tests compare the two. What is different here:
/// - Eq. (4) is divided by the number of the iteration, t: an anchor then weighs 1 in all of them,
///   and a satellite (t - g) / t. So one sum over the whole cell does for both.
/// - The estimate of a vertex is kept as w d and w in four numbers next to each other, so that one
///   load and one multiply-add take a neighbour into numerator and denominator. It is zero as long
///   as the vertex is not reached, and that is how generations are found on the way.
/// - s_ij is computed in the first iteration and kept for the others.
/// - Cells have eight slots each, the last ones empty; the few vertices with more neighbours take
///   a slower path of their own.
///
/// sweeps.cpp is compiled once for each kind of processor; `runnable_sweeps` tells which may be
/// used.
#pragma once

#include <dynmesh/types.hpp>
#include <vector>

namespace dynmesh {

/// How many neighbours the fast path takes.
constexpr int slots = 8;

/// The arrays of a mesh and its frame; a quad is four Reals, aligned as such.
template <class Real>
struct SweepData {
  // Of the mesh; `neighbours` has eight slots per vertex, each the offset of a quad in bytes.
  const std::uint32_t* neighbours;
  const std::uint8_t* valence;   // (k,) how many of the slots are taken; more than 8: see cells
  const std::uint8_t* narrow;    // (k,) 1 where there are no more than eight, else 0
  const Index* wide;             // the vertices with more, ascending
  const Index* cell_offsets;     // (k + 1,) of
  const Index* cell_neighbours;  // the cells of vertices with more neighbours
  Real inverse_mean_edge;        // 1 / h
  // Of the frame.
  const std::uint8_t* known;  // (k,)
  const Real* previous;       // (k,) quads: V
  Real* points;               // (k,) quads: anchors as given; satellites are filled in
  Index* generation;          // (k,)
  // Of the iterations.
  Real* weights;  // (k, 8) s_ij
  Real* before;   // (k,) quads: w d / t and w / t before the iteration
  Real* after;    // and after it
  Real* visits;   // (k,) iterations that found the vertex reached
  Index* rows;    // (k,) unknown vertices; see Rows
};

/// A chunk of vertices and which of them are unknown: those with up to eight neighbours from
/// `rows[first]` on, the others before `rows[last]`, backwards.
struct Rows {
  Index first;
  Index last;
  Index first_wide;  // in the list of all vertices with more neighbours, its part of them
  Index last_wide;
  Index narrow;
  Index wide;
  Index reached;  // of them, after the last iteration
};

template <class Real>
struct Sweeps {
  /// Sets the estimates of the vertices of a chunk and finds out which are unknown.
  Rows (*prepare)(const SweepData<Real>& data, const Rows& chunk);
  /// Iteration 1. Returns how many of the rows were reached so far, as `next` does.
  Index (*first)(const SweepData<Real>& data, const Rows& rows);
  /// Iteration t = 2, 3, ...
  Index (*next)(const SweepData<Real>& data, const Rows& rows, Index t);
  /// Places the reached rows by the estimates in `before`, and sets the generation of all rows, if
  /// there were so many iterations.
  void (*finish)(const SweepData<Real>& data, const Rows& rows, Index iterations);
};

/// Those that this processor runs, the fastest first.
template <class Real>
std::vector<const Sweeps<Real>*> runnable_sweeps();

}  // namespace dynmesh
