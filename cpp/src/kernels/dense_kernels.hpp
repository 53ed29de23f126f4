/// The inner loops of the masked factorisation, optimised for each kind of processor.
///
/// A panel is a dense block of a triangular factor: `rows` rows of `columns` numbers, packed row by
/// row. Its first `columns` rows are the triangle.
#pragma once

#include <dynmesh/types.hpp>

namespace dynmesh {

/// The largest number of columns of a supernode, and therefore of a panel. The diagonal blocks then
/// fit into the first-level cache.
constexpr Index widest_supernode = 32;
/// The rows of a product begin at multiples of this number of elements.
constexpr Index stride_of_products = 8;

/// The number of elements that the functions below need in `work`, where `factor_triangle`
/// stores a transposed triangle.
constexpr Index most_work = widest_supernode * widest_supernode;
static_assert(most_work >= 16 * widest_supernode, "the rows that `multiply` packs");

/// The steps of solving with the factor. `values` has (n, fields) quads, row by row, each a
/// right-hand side, of which `own` are those of the rows of the panel.
template <class Real>
struct SolveKernels {
  /// Solves with the triangle.
  void (*forward)(const Real* panel, Index columns, const Real* inverse, Real* own);
  /// Subtracts the products of `n` rows below the triangle with the solution `own` from the
  /// `values` in rows `targets`.
  void (*subtract_products)(const Real* rows, Index n, Index columns, const Real* own,
                            const Index* targets, Real* values);
  /// Does both with the transposed factor, where `below` lists the rows below the triangle.
  void (*backward)(const Real* panel, Index rows, Index columns, const Real* inverse, Real* own,
                   const Index* below, const Real* values);
};

struct DenseKernels {
  /// Computes products (m, stride) = a (m, c) times the transpose of b (n, c), where row i of a is
  /// row `first` + i of a symmetric product: columns after that of its diagonal are undefined. The
  /// stride is n rounded up to a multiple of `stride_of_products`; the columns from n on are
  /// undefined. c is at most `widest_supernode`.
  void (*multiply)(const double* a, Index m, Index first, const double* b, Index n, Index c,
                   double* products, double* work);

  /// Replaces the triangle of a panel of the matrix by that of its Cholesky factor, stores the
  /// inverse of the diagonal in `inverse` (columns,) and the transpose in `work`. A pivot that is
  /// not above its `least` is left out: its inverse is 0, and so are the entries below it. The
  /// upper half of the triangle is not read. `columns` is at most `widest_supernode`.
  void (*factor_triangle)(double* panel, Index columns, const double* least, double* inverse,
                          double* work);
  /// Replaces `n` rows of a panel below its triangle by those of its Cholesky factor, with the
  /// `inverse` and the `work` that `factor_triangle` left.
  void (*factor_below)(double* rows, Index n, Index columns, const double* inverse,
                       const double* work);

  SolveKernels<double> of_one_field;
  SolveKernels<double> of_three_fields;
  SolveKernels<float> of_one_rounded_field;
};

}  // namespace dynmesh
