/// The inner loops of method motion, optimised for each kind of processor, and those that copy
/// frames between the rows of a caller and the internal arrays.
///
/// They compute the estimates of eq. (4) with these differences, and the tests compare them with a
/// literal version:
/// - Eq. (4) is divided by the number of the iteration, t. An anchor then has weight 1 in all
///   iterations and a satellite (t - g) / t, so a single sum over the cell suffices.
/// - The estimate of a vertex is stored as w d and w in four adjacent numbers, so that one load and
///   one multiply-add include a neighbour in numerator and denominator. It is zero until the vertex
///   is reached, which also determines the generations.
/// - s_ij is computed in the first iteration and stored for the others.
/// - Each cell has eight slots for neighbours, of which the last may be empty. Loops over six and
///   over eight slots process the vertices that have no more neighbours, and a slower one the few
///   others.
#pragma once

#include <dynmesh/types.hpp>

namespace dynmesh {

/// The number of neighbours that the fast loops support, and that of a usual cell at most.
constexpr int slots = 8;
constexpr int usual_slots = 6;

/// The arrays of a mesh and a frame. A quad is four Reals, aligned to its size.
template <class Real>
struct SweepData {
  // Of the mesh. `neighbours` has eight slots per vertex, each the offset of a quad in bytes.
  const std::uint32_t* neighbours;
  const std::uint8_t* valence;  // (k,) the number of slots in use; 9 if there are more neighbours
  const Index* wide;            // the vertices with more than eight neighbours, ascending
  // The slots of these vertices: vertex v has those from neighbours[8 v] to neighbours[8 v + 1] -
  // 1, of which those from neighbours[8 v + 2] on are empty.
  const std::uint32_t* wide_neighbours;
  Real inverse_mean_edge;  // 1 / h
  // Of the frame:
  const std::uint8_t* known;  // (k,)
  const Real* previous;       // (k,) quads: V
  Real* points;               // (k,) quads: anchors as given; satellites are written here
  Index* generation;          // (k,)
  // Of the iterations:
  Real* weights;       // (k, 8) s_ij
  Real* wide_weights;  // s_ij of `wide_neighbours`
  Real* before;        // (k,) quads: w d / t and w / t before the iteration
  Real* after;         // (k,) quads: the same after the iteration
  Real* visits;        // (k,) the number of iterations that gave the vertex an estimate
  Index* rows;         // (k,) unknown vertices; see Rows
};

/// A chunk of vertices and a list of its unknown vertices: from `rows[first]` on those with up to
/// six neighbours, then those with more than eight, and the others backwards from `rows[last - 1]`.
struct Rows {
  Index first;
  Index last;
  Index first_wide;  // the range of this chunk in `wide`, the list of all vertices with more
                     // neighbours
  Index last_wide;
  Index usual;  // the numbers of those with up to six neighbours, up to eight, and more
  Index narrow;
  Index wide;
  Index reached;  // how many of the unknown vertices have been reached
};

template <class Real>
struct Sweeps {
  /// Sets the estimates of the vertices of a chunk and lists the unknown ones.
  Rows (*prepare)(const SweepData<Real>& data, const Rows& chunk);
  /// Executes iteration t = 1, 2, ... Returns how many of the rows have been reached so far.
  Index (*sweep)(const SweepData<Real>& data, const Rows& rows, Index t);
  /// Computes the positions of the reached rows from the estimates in `before`, and sets the
  /// generation of all rows. `iterations` is the number of iterations that were executed.
  void (*finish)(const SweepData<Real>& data, const Rows& rows, Index iterations);

  /// Reads the vertices `first` to `last` - 1 from packed rows into `points`. `observed` has a byte
  /// for each row; if it is null, finite rows are known. Returns whether all known rows are within
  /// `limit`.
  bool (*read)(const Real* rows, const std::uint8_t* observed, Real limit, Index first, Index last,
               Real* points, std::uint8_t* known);
  /// Writes these vertices. A vertex that is beyond `limit` or NaN is first reset to `previous`.
  void (*write)(Real* points, const Real* previous, Real limit, Index first, Index last,
                Real* rows);
};

}  // namespace dynmesh
