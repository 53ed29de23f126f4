/// The inner loops of the masked factorisation, as fast as the processor allows.
///
/// A panel is a dense block of a triangular factor: `rows` rows of `columns` numbers, packed, row
/// after row; its first `columns` rows are the triangle. dense_kernels.cpp is compiled once for
/// each kind of processor; `runnable_dense_kernels` tells which may be used.
#pragma once

#include <dynmesh/types.hpp>

namespace dynmesh {

/// Supernodes, and so the panels made of them, have at most this many columns, so that their
/// diagonal blocks stay in the fastest cache.
constexpr Index widest_supernode = 32;
static_assert(widest_supernode % 4 == 0, "products of full panels take no more columns than that");

/// How many numbers the functions below need in `work`: `factor` puts a transposed triangle there.
constexpr Index most_work = widest_supernode * widest_supernode;
static_assert(most_work >= 8 * widest_supernode, "the rows that `multiply` packs");

struct DenseKernels {
  /// products (m, stride) = a (m, c) times the transpose of b (n, c), with stride = n rounded up to
  /// a multiple of 4; what stands beyond column n means nothing. c is at most `widest_supernode`.
  void (*multiply)(const double* a, Index m, const double* b, Index n, Index c, double* products,
                   double* work);

  /// Turns a panel of the matrix into one of its Cholesky factor, in place, and the diagonal into
  /// `inverse` (columns,), one over it. A pivot not above its `least` is left out: inverse 0, zeros
  /// below. Of the triangle's upper half nothing is read. `columns` is at most `widest_supernode`.
  void (*factor)(double* panel, Index rows, Index columns, const double* least, double* inverse,
                 double* work);

  /// One step of solving with the factor: `values` are quads of one right-hand side, (n, fields)
  /// quads row after row; the panel's own rows stand from row `first` on, those below it at the
  /// rows `below`.
  void (*solve_forward)(const double* panel, Index rows, Index columns, const double* inverse,
                        Index first, const Index* below, double* values, int fields);
  /// And with its transpose.
  void (*solve_backward)(const double* panel, Index rows, Index columns, const double* inverse,
                         Index first, const Index* below, double* values, int fields);
};

}  // namespace dynmesh
